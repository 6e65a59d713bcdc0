#pragma once
/// Which points the force on a point depends on: those that families reach in a given number of steps.

#include "assembly/block_rows.hpp"
#include "perikit/core/block_matrix.hpp"

namespace perikit {

/// K couples the rows that are at most `steps` bonds apart.
void make_pattern(const BlockRows& rows, int steps, BlockMatrix& K);

/// Blocks of that pattern, from rows spread over the body; exact for few points.
std::size_t predict_blocks(const BlockRows& rows, int steps);

/// Finds the rows at most `steps` bonds from one row. One per thread.
class Reach {
 public:
  /// Not sorted: the row itself, then its family, then those of the family ... each once.
  const std::vector<std::int32_t>& of(const BlockRows& rows, std::size_t row, int steps);
  /// Place of a row in the last result; only for rows that are in it.
  std::size_t place(std::int32_t row) const noexcept { return static_cast<std::size_t>(place_[static_cast<std::size_t>(row)]); }

 private:
  std::vector<std::int32_t> place_;  ///< by row; -1: not found
  std::vector<std::int32_t> found_;
};

/// Adds blocks to one row of K. Columns must exist.
class RowPlaces {
 public:
  /// Columns of this row -> places of their blocks. O(blocks of the row).
  void open(const BlockMatrix& K, std::size_t row) {
    place_.resize(K.rows());
    for (std::int64_t b = K.row_first[row]; b < K.row_first[row + 1]; ++b)
      place_[static_cast<std::size_t>(K.column[static_cast<std::size_t>(b)])] = b;
  }
  double* block(BlockMatrix& K, std::int32_t column, std::size_t entries) const noexcept {
    return K.values.data() + static_cast<std::size_t>(place_[static_cast<std::size_t>(column)]) * entries;
  }

 private:
  std::vector<std::int64_t> place_;
};

}  // namespace perikit
