#include "free_matrix.hpp"

#include <algorithm>

#include "perikit/core/parallel.hpp"

namespace perikit {

FreeMatrix::FreeMatrix(const BlockMatrix& K, ConstFieldView free) : dimension_(K.dimension), unknown_(K.rows() * static_cast<std::size_t>(K.dimension), -1) {
  for (std::size_t r = 0; r < K.rows(); ++r)
    for (int a = 0; a < dimension_; ++a) {
      const std::size_t place = static_cast<std::size_t>(a) * free.stride + static_cast<std::size_t>(K.point[r]);
      if (free.data[place] == 0) continue;
      unknown_[r * static_cast<std::size_t>(dimension_) + static_cast<std::size_t>(a)] = static_cast<Index>(place_.size());
      place_.push_back(place);
    }
}

/// visit(row, index of the transposed entry in K.values): the pattern is structurally symmetric, so that block row r names the rows of
/// column block r. The entry (row, column) of a whole matrix is not in that block row, but in its mirror, which `values` looks up.
template <class Visit>
void FreeMatrix::visit_column(const BlockMatrix& K, std::size_t r, int a, bool upper, Visit&& visit) const {
  const Index column = unknown(r, a);
  const auto d = static_cast<std::int64_t>(dimension_);
  for (std::int64_t b = K.row_first[r]; b < K.row_first[r + 1]; ++b) {
    const auto other = static_cast<std::size_t>(K.column[static_cast<std::size_t>(b)]);
    if (upper && other > r) break;
    for (int c = 0; c < dimension_; ++c) {
      const Index row = unknown(other, c);
      if (row < 0 || (upper && row > column)) continue;
      visit(row, static_cast<std::size_t>((b * d + a) * d + c), other, c);
    }
  }
}

void FreeMatrix::pattern(const BlockMatrix& K, bool upper, std::vector<Index>& first, std::vector<Index>& row) const {
  first.assign(1, 0);
  row.clear();
  for (std::size_t r = 0; r < K.rows(); ++r)
    for (int a = 0; a < dimension_; ++a) {
      if (unknown(r, a) < 0) continue;
      visit_column(K, r, a, upper, [&](Index at, std::size_t, std::size_t, int) { row.push_back(at); });
      first.push_back(static_cast<Index>(row.size()));
    }
}

void FreeMatrix::values(const BlockMatrix& K, bool upper, const std::vector<Index>& first, std::vector<double>& value) const {
  value.resize(static_cast<std::size_t>(first.back()));
  const auto d = static_cast<std::int64_t>(dimension_);
  parallel_for(K.rows(), [&](std::size_t r) {
    for (int a = 0; a < dimension_; ++a) {
      const Index column = unknown(r, a);
      if (column < 0) continue;
      auto at = static_cast<std::size_t>(first[static_cast<std::size_t>(column)]);
      visit_column(K, r, a, upper, [&](Index, std::size_t transposed, std::size_t other, int c) {
        if (K.symmetric) {
          value[at++] = K.values[transposed];
          return;
        }
        const auto begin = K.column.begin() + K.row_first[other], end = K.column.begin() + K.row_first[other + 1];
        const std::int64_t mirror = std::lower_bound(begin, end, static_cast<std::int32_t>(r)) - K.column.begin();
        value[at++] = K.values[static_cast<std::size_t>((mirror * d + c) * d + a)];
      });
    }
  });
}

}  // namespace perikit
