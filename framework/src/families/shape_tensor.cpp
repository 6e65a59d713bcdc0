#include "families/shape_tensor.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <limits>

namespace perikit {

namespace {

template <int D>
using Square = Eigen::Matrix<double, D, D>;

template <int D>
Square<D> matrix(const double* k) {
  Square<D> m;
  for (int a = 0; a < D; ++a)
    for (int b = 0; b < D; ++b) m(a, b) = k[symmetric_index(D, a, b)];
  return m;
}

template <int D>
double ratio(const double* k) {
  const Eigen::SelfAdjointEigenSolver<Square<D>> eigen(matrix<D>(k), Eigen::EigenvaluesOnly);
  const double high = eigen.eigenvalues()(D - 1);
  return high > 0 ? std::max(0.0, eigen.eigenvalues()(0) / high) : 0.0;
}

template <int D>
bool invert(const double* k, double* inverse, double* condition) {
  const Eigen::SelfAdjointEigenSolver<Square<D>> eigen(matrix<D>(k));
  const double low = eigen.eigenvalues()(0), high = eigen.eigenvalues()(D - 1);
  const bool regular = high > 0 && low > singular_ratio * high;
  if (condition) *condition = regular ? high / low : std::numeric_limits<double>::infinity();
  Square<D> m = Square<D>::Zero();
  if (regular) m = eigen.eigenvectors() * eigen.eigenvalues().cwiseInverse().asDiagonal() * eigen.eigenvectors().transpose();
  for (int a = 0; a < D; ++a)
    for (int b = a; b < D; ++b) inverse[symmetric_index(D, a, b)] = m(a, b);
  return regular;
}

/// Eigenvalues of K relative to W = L L^T are those of L^-1 K L^-T.
template <int D>
double support(const double* k, const double* whole) {
  double inverse[6];
  if (!invert<D>(k, inverse, nullptr) || !invert<D>(whole, inverse, nullptr)) return 0;
  const Square<D> L = matrix<D>(whole).llt().matrixL();
  Square<D> relative = L.template triangularView<Eigen::Lower>().solve(matrix<D>(k));
  relative = L.template triangularView<Eigen::Lower>().solve(relative.transpose().eval());
  const Eigen::SelfAdjointEigenSolver<Square<D>> eigen(relative, Eigen::EigenvaluesOnly);
  return std::clamp(eigen.eigenvalues()(0), 0.0, 1.0);
}

}  // namespace

double eigenvalue_ratio(int d, const double* K) { return d == 1 ? ratio<1>(K) : d == 2 ? ratio<2>(K) : ratio<3>(K); }

bool invert_shape(int d, const double* K, double* inverse, double* condition) {
  return d == 1 ? invert<1>(K, inverse, condition) : d == 2 ? invert<2>(K, inverse, condition) : invert<3>(K, inverse, condition);
}

double shape_support(int d, const double* K, const double* whole) {
  return d == 1 ? support<1>(K, whole) : d == 2 ? support<2>(K, whole) : support<3>(K, whole);
}

}  // namespace perikit
