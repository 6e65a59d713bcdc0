#pragma once
/// Symmetric d x d shape tensors K and their inverses, stored as xx | xx yy xy | xx yy zz xy xz yz.

#include <Eigen/Dense>
#include <limits>

namespace perikit {

constexpr int symmetric_components(int d) noexcept { return d * (d + 1) / 2; }

/// Position of entry (a, b) in the storage above.
constexpr int symmetric_index(int d, int a, int b) noexcept {
  if (a == b) return a;
  return d == 2 ? 2 : 2 + a + b;
}

/// K is singular when its eigenvalues spread by more than this: the family spans no volume up to rounding of the positions.
inline constexpr double singular_ratio = 1e-8;
/// Parts and domains of bonds are ill conditioned when the eigenvalues of K spread by more than this (they lie almost in a plane or
/// on a line, 30 times as long as thick): their gradients magnify noise as much.
inline constexpr double poor_ratio = 1e-3;

template <int D>
using Square = Eigen::Matrix<double, D, D>;

template <int D>
Square<D> symmetric_matrix(const double* k) {
  Square<D> m;
  for (int a = 0; a < D; ++a)
    for (int b = 0; b < D; ++b) m(a, b) = k[symmetric_index(D, a, b)];
  return m;
}

/// Inverse of K by its eigen-decomposition; zero, and false, where K is singular. condition: ratio of its eigenvalues.
template <int D>
bool invert_shape(const double* k, double* inverse, double* condition = nullptr) {
  const Eigen::SelfAdjointEigenSolver<Square<D>> eigen(symmetric_matrix<D>(k));
  const double low = eigen.eigenvalues()(0), high = eigen.eigenvalues()(D - 1);
  const bool regular = high > 0 && low > singular_ratio * high;
  if (condition) *condition = regular ? high / low : std::numeric_limits<double>::infinity();
  Square<D> m = Square<D>::Zero();
  if (regular) m = eigen.eigenvectors() * eigen.eigenvalues().cwiseInverse().asDiagonal() * eigen.eigenvectors().transpose();
  for (int a = 0; a < D; ++a)
    for (int b = a; b < D; ++b) inverse[symmetric_index(D, a, b)] = m(a, b);
  return regular;
}

}  // namespace perikit
