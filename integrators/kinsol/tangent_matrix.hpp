#pragma once
#include <string>
#include <vector>

#include <sundials/sundials_matrix.h>

#include "../shared/free_matrix.hpp"
#include "perikit/problem/integrator.hpp"

namespace perikit {

/// The assembled tangent as a SUNDIALS sparse matrix over whole fields: the identity on prescribed and dead components.
class TangentMatrix {
 public:
  TangentMatrix(Problem& problem, SUNContext context);
  ~TangentMatrix();
  TangentMatrix(const TangentMatrix&) = delete;
  TangentMatrix& operator=(const TangentMatrix&) = delete;

  SUNMatrix get() const noexcept { return matrix_; }
  /// Writes pattern and values at u. False where u is inadmissible; `failure` says why.
  bool assemble(Problem& problem, ConstFieldView u, std::string& failure);

 private:
  BlockMatrix tangent_;
  FreeMatrix free_;
  std::vector<FreeMatrix::Index> first_, row_, unknown_at_;   ///< of the free part; unknown of a field component or -1
  std::vector<double> value_;
  SUNMatrix matrix_ = nullptr;
};

}  // namespace perikit
