#pragma once
/// Eigenvalues of small symmetric matrices, compiled once: every other source does without Eigen's decompositions, which take a
/// compiler ten times as long as what uses them.

#include <cstddef>
#include <vector>

namespace perikit {

/// A = sum_k value[k] vector_k (x) vector_k, eigenvalues ascending, eigenvectors of unit length.
class SymmetricEigen {
 public:
  /// A: symmetric, n x n. Without vectors there are values alone.
  SymmetricEigen(int n, const double* A, bool vectors = true);
  SymmetricEigen(const SymmetricEigen&) = delete;
  double value(int k) const noexcept { return values_[static_cast<std::size_t>(k)]; }
  /// Component i of eigenvector k.
  double vector(int i, int k) const noexcept { return vectors_[static_cast<std::size_t>(k * n_ + i)]; }
  double least() const noexcept { return values_[0]; }
  double largest() const noexcept { return values_[static_cast<std::size_t>(n_ - 1)]; }

 private:
  static constexpr int most_inline = 6;
  int n_;
  double inline_[most_inline * (most_inline + 1)];  ///< of small matrices, values and vectors
  std::vector<double> memory_;                      ///< of others
  double *values_, *vectors_;
};

/// A <- its nearest positive semidefinite matrix: negative eigenvalues become zero. A: symmetric, n x n. Untouched where there are none.
void make_semidefinite(double* A, int n);

}  // namespace perikit
