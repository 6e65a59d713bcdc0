#pragma once
#include <sundials/sundials_matrix.h>

#include <string>
#include <vector>

#include "../shared/assembled_tangent.hpp"
#include "../shared/free_matrix.hpp"

namespace perikit {

/// The assembled tangent as a SUNDIALS sparse matrix over whole fields: the identity on prescribed and dead components.
class TangentMatrix {
 public:
  TangentMatrix(Problem& problem, SUNContext context);
  ~TangentMatrix();
  TangentMatrix(const TangentMatrix&) = delete;
  TangentMatrix& operator=(const TangentMatrix&) = delete;

  SUNMatrix get() const noexcept { return matrix_; }
  /// Writes pattern and values at u, of a convex tangent where AssembledTangent says so. False where u is inadmissible; `failure`
  /// says why.
  bool assemble(Equilibrium& equilibrium, ConstFieldView u, std::string& failure);
  AssembledTangent& tangent() noexcept { return tangent_; }

 private:
  AssembledTangent tangent_;
  FreeMatrix free_;
  std::vector<FreeMatrix::Index> first_, row_, unknown_at_;  ///< of the free part; unknown of a field component or -1
  std::vector<double> value_;
  SUNMatrix matrix_ = nullptr;
};

}  // namespace perikit
