#include "families/shape_tensor.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/symmetric_matrix.hpp"

namespace perikit {

namespace {

/// d x d, from its upper triangle.
struct Square {
  double entries[9] = {};
  int d;
  explicit Square(int dimension) : d(dimension) {}
  Square(int dimension, const double* k) : d(dimension) {
    for (int a = 0; a < d; ++a)
      for (int b = 0; b < d; ++b) (*this)(a, b) = k[symmetric_index(d, a, b)];
  }
  double& operator()(int a, int b) noexcept { return entries[a * d + b]; }
};

bool regular(const SymmetricEigen& eigen) noexcept { return eigen.largest() > 0 && eigen.least() > singular_ratio * eigen.largest(); }

}  // namespace

double eigenvalue_ratio(int d, const double* K) {
  const SymmetricEigen eigen(d, Square(d, K).entries, false);
  return eigen.largest() > 0 ? std::max(0.0, eigen.least() / eigen.largest()) : 0.0;
}

bool invert_shape(int d, const double* K, double* inverse, double* condition) {
  const SymmetricEigen eigen(d, Square(d, K).entries);
  const bool exists = regular(eigen);
  if (condition) *condition = exists ? eigen.largest() / eigen.least() : std::numeric_limits<double>::infinity();
  for (int a = 0; a < d; ++a)
    for (int b = a; b < d; ++b) {
      double sum = 0;
      for (int k = 0; k < d && exists; ++k) sum += eigen.vector(a, k) * (1 / eigen.value(k)) * eigen.vector(b, k);
      inverse[symmetric_index(d, a, b)] = sum;
    }
  return exists;
}

/// Eigenvalues of K relative to W = Q L Q^T are those of L^-1/2 Q^T K Q L^-1/2.
double shape_support(int d, const double* K, const double* whole) {
  Square k(d, K);
  const SymmetricEigen own(d, k.entries, false), all(d, Square(d, whole).entries);
  if (!regular(own) || !regular(all)) return 0;
  Square relative(d);
  for (int a = 0; a < d; ++a)
    for (int b = 0; b < d; ++b) {
      double sum = 0;
      for (int i = 0; i < d; ++i)
        for (int j = 0; j < d; ++j) sum += all.vector(i, a) * k(i, j) * all.vector(j, b);
      relative(a, b) = sum / (std::sqrt(all.value(a)) * std::sqrt(all.value(b)));   // the product of two may have no number
    }
  return std::clamp(SymmetricEigen(d, relative.entries, false).least(), 0.0, 1.0);
}

}  // namespace perikit
