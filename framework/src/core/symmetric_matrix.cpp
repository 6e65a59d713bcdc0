#include "core/symmetric_matrix.hpp"

#include "core/eigen.hpp"

namespace perikit {

namespace {

template <int N>
void find(int n, const double* A, bool wanted, double* values, double* vectors) {
  using Matrix = Eigen::Matrix<double, N, N>;
  const Eigen::SelfAdjointEigenSolver<Matrix> modes(Eigen::Map<const Matrix>(A, n, n),
                                                    wanted ? Eigen::ComputeEigenvectors : Eigen::EigenvaluesOnly);
  Eigen::Map<Eigen::Matrix<double, N, 1>>(values, n) = modes.eigenvalues();
  if (wanted) Eigen::Map<Matrix>(vectors, n, n) = modes.eigenvectors();
}

}  // namespace

SymmetricEigen::SymmetricEigen(int n, const double* A, bool vectors) : n_(n) {
  if (n > most_inline) memory_.resize(static_cast<std::size_t>(n) * static_cast<std::size_t>(n + 1));
  values_ = n > most_inline ? memory_.data() : inline_;
  vectors_ = values_ + n;
  if (n == 2) find<2>(n, A, vectors, values_, vectors_);
  else if (n == 3) find<3>(n, A, vectors, values_, vectors_);
  else if (n > 0) find<Eigen::Dynamic>(n, A, vectors, values_, vectors_);
}

void make_semidefinite(double* A, int n) {
  const SymmetricEigen modes(n, A);
  if (modes.least() >= 0) return;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j <= i; ++j) {
      double sum = 0;
      for (int k = 0; k < n; ++k)
        if (modes.value(k) > 0) sum += modes.value(k) * modes.vector(i, k) * modes.vector(j, k);
      A[i * n + j] = A[j * n + i] = sum;
    }
}

}  // namespace perikit
