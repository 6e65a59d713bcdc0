#include "tangent_matrix.hpp"

#include <sunmatrix/sunmatrix_sparse.h>

namespace perikit {

TangentMatrix::TangentMatrix(Problem& problem, SUNContext context) {
  // The pattern does not depend on the state.
  const Field rest = problem.make_field();
  BlockMatrix K;
  if (!problem.assemble_tangent({rest, 0}, K).ok()) throw RunError("kinsol: the tangent of the undeformed body cannot be assembled");
  const ConstFieldView mask = problem.constraints().free();
  free_ = FreeMatrix(K, mask);
  free_.pattern(K, false, first_, row_);
  unknown_at_.assign(mask.size(), -1);
  for (std::size_t k = 0; k < free_.unknowns(); ++k) unknown_at_[free_.place(k)] = static_cast<FreeMatrix::Index>(k);
  const auto n = static_cast<sunindextype>(mask.size());
  matrix_ = SUNSparseMatrix(n, n, static_cast<sunindextype>(row_.size() + mask.size() - free_.unknowns()), CSC_MAT, context);
  if (!matrix_) throw RunError("kinsol: not enough memory for the assembled tangent");
}

TangentMatrix::~TangentMatrix() {
  SUNMatDestroy(matrix_);
}

bool TangentMatrix::assemble(Equilibrium& equilibrium, ConstFieldView u, std::string& failure) {
  if (!tangent_.assemble(equilibrium, equilibrium.at(u), true, failure)) return false;
  free_.values(tangent_.matrix(), false, first_, value_);
  sunindextype* pointers = SUNSparseMatrix_IndexPointers(matrix_);
  sunindextype* rows = SUNSparseMatrix_IndexValues(matrix_);
  double* values = SUNSparseMatrix_Data(matrix_);
  sunindextype at = 0;
  for (std::size_t column = 0; column < unknown_at_.size(); ++column) {
    pointers[column] = at;
    const FreeMatrix::Index unknown = unknown_at_[column];
    if (unknown < 0) {
      rows[at] = static_cast<sunindextype>(column);
      values[at++] = 1.0;
      continue;
    }
    for (auto k = static_cast<std::size_t>(first_[static_cast<std::size_t>(unknown)]);
         k < static_cast<std::size_t>(first_[static_cast<std::size_t>(unknown) + 1]); ++k) {
      rows[at] = static_cast<sunindextype>(free_.place(static_cast<std::size_t>(row_[k])));
      values[at++] = value_[k];
    }
  }
  pointers[unknown_at_.size()] = at;
  return true;
}

}  // namespace perikit
