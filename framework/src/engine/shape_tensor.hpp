#pragma once
/// Symmetric d x d shape tensors K and their inverses, stored as xx | xx yy xy | xx yy zz xy xz yz.

#include <Eigen/Dense>
#include <algorithm>
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

/// A part is also ill conditioned when its eigenvalues spread by more than this times those of its whole family: a needle in a
/// family that is none. Near the surfaces of clouds such parts are stiffer than all others and set the stable step. The parts of
/// lattices, also one layer below a surface and at a horizon of five spacings, spread by less.
inline constexpr double part_ratio = 0.05;

template <int D>
using Square = Eigen::Matrix<double, D, D>;

template <int D>
Square<D> symmetric_matrix(const double* k) {
  Square<D> m;
  for (int a = 0; a < D; ++a)
    for (int b = 0; b < D; ++b) m(a, b) = k[symmetric_index(D, a, b)];
  return m;
}

/// Smallest eigenvalue of K over the largest one; 0 where K is zero.
template <int D>
double eigenvalue_ratio(const Square<D>& K) {
  const Eigen::SelfAdjointEigenSolver<Square<D>> eigen(K, Eigen::EigenvaluesOnly);
  const double high = eigen.eigenvalues()(D - 1);
  return high > 0 ? std::max(0.0, eigen.eigenvalues()(0) / high) : 0.0;
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

/// What broken bonds leave of the shape tensor of a whole family, in its weakest direction: the smallest eigenvalue of K relative to
/// `whole`, in [0, 1]. 0 where either is singular.
template <int D>
double shape_support(const double* k, const double* whole) {
  double inverse[6];
  if (!invert_shape<D>(k, inverse) || !invert_shape<D>(whole, inverse)) return 0;
  const Eigen::GeneralizedSelfAdjointEigenSolver<Square<D>> eigen(symmetric_matrix<D>(k), symmetric_matrix<D>(whole), Eigen::EigenvaluesOnly);
  return std::clamp(eigen.eigenvalues()(0), 0.0, 1.0);
}

/// A point whose family is left with less support than this is a fragment: it loses its other bonds too. The family of a corner keeps 1/4 in
/// a plane and 1/8 in space; with less there is no continuum around the point whose gradient its few bonds could measure.
inline constexpr double least_support = 0.1;

}  // namespace perikit
