#include "block_product.hpp"

#include "perikit/core/field_operations.hpp"

namespace perikit {

void multiply(const BlockMatrix& K, ConstFieldView w, FieldView Kw) {
  const int d = K.dimension;
  fill(0.0, Kw);
  parallel_for(K.rows(), [&](std::size_t r) {
    double sum[3] = {};
    for (std::int64_t b = K.row_first[r]; b < K.row_first[r + 1]; ++b) {
      const double* block = &K.values[static_cast<std::size_t>(b * d * d)];
      const auto p = static_cast<std::size_t>(K.point[static_cast<std::size_t>(K.column[static_cast<std::size_t>(b)])]);
      for (int a = 0; a < d; ++a)
        for (int c = 0; c < d; ++c) sum[a] += block[a * d + c] * w.component(c)[p];
    }
    for (int a = 0; a < d; ++a) Kw.component(a)[K.point[r]] = sum[a];
  });
}

}  // namespace perikit
