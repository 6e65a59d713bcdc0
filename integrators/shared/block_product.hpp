#pragma once
#include "perikit/core/block_matrix.hpp"

namespace perikit {

/// Kw <- K w on the points of K, 0 elsewhere; on all threads.
void multiply(const BlockMatrix& K, ConstFieldView w, FieldView Kw);

}  // namespace perikit
