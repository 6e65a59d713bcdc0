#pragma once
/// Sparse matrices of small dense blocks, one block row per live point: assembled tangents.

#include <cstdint>
#include <vector>

#include "perikit/core/field.hpp"

namespace perikit {

/// Compressed block rows. Block b couples block row r, row_first[r] <= b < row_first[r + 1], with block row column[b] (ascending within
/// a row); its entry (a, c) is values[(b * dimension + a) * dimension + c]. The pattern is structurally symmetric.
struct BlockMatrix {
  int dimension = 0;                      ///< of the blocks: displacement components
  bool symmetric = true;                  ///< in values too, to rounding
  bool convex = false;                    ///< asked for: without the negative curvatures of evaluation points, so that K is semidefinite
  std::vector<std::int32_t> point;        ///< field index of each block row, ascending
  std::vector<std::int64_t> row_first;    ///< point.size() + 1 entries
  std::vector<std::int32_t> column;       ///< block rows, not field indices
  AlignedVector<double> values;           ///< [N/m]

  std::size_t rows() const noexcept { return point.size(); }
  std::size_t blocks() const noexcept { return column.size(); }
  bool has_pattern() const noexcept { return !row_first.empty(); }
};

/// What an assembled tangent takes.
struct AssembledSize {
  std::size_t blocks = 0;                     ///< of dimension x dimension
  std::size_t bytes = 0;                      ///< of the matrix and of what its assembly keeps
};

}  // namespace perikit
