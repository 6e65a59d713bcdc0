#include "core/semidefinite.hpp"

#include <Eigen/Eigenvalues>

namespace perikit {

void make_semidefinite(double* A, int n) {
  Eigen::Map<Eigen::MatrixXd> matrix(A, n, n);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> modes(matrix);
  if (modes.eigenvalues()(0) >= 0) return;
  matrix = modes.eigenvectors() * modes.eigenvalues().cwiseMax(0).asDiagonal() * modes.eigenvectors().transpose();
}

}  // namespace perikit
