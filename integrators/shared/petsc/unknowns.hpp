#pragma once
/// The numbers of unknowns over all ranks, as distributed matrices want them: rank by rank, `dimension` for each point.

#include <cstdint>
#include <vector>

#include "perikit/core/block_matrix.hpp"
#include "perikit/problem/problem.hpp"

namespace perikit {

/// Points with a free component have a number, and all their components are unknowns, so that the blocks of a matrix stay whole.
class Unknowns {
 public:
  /// K: of the problem, with complete rows at owned points. free: 1 on free components of these. All ranks must call it.
  Unknowns(Problem& problem, const BlockMatrix& K, ConstFieldView free);

  int dimension() const noexcept { return free_.components(); }
  /// Points of this rank, the number of its first one, and points of all ranks.
  std::int64_t mine() const noexcept { return static_cast<std::int64_t>(row_.size()); }
  std::int64_t before() const noexcept { return before_; }
  std::int64_t of_all() const noexcept { return of_all_; }

  /// Visits the blocks of K in the row of this rank's k-th point: visit(number of the column's point, whose it may be, values),
  /// the values in rows, with 0 for prescribed components but on the diagonal.
  template <class Visit>
  void over_row(const BlockMatrix& K, std::int64_t k, Visit&& visit) const {
    const auto d = static_cast<std::size_t>(dimension());
    const std::int32_t row = row_[static_cast<std::size_t>(k)], p = K.point[static_cast<std::size_t>(row)];
    for (std::int64_t b = K.row_first[static_cast<std::size_t>(row)]; b < K.row_first[static_cast<std::size_t>(row) + 1]; ++b) {
      const std::int32_t column = K.column[static_cast<std::size_t>(b)], q = K.point[static_cast<std::size_t>(column)];
      const auto number = static_cast<std::int64_t>(number_.data()[q]);
      if (number < 0) continue;
      double block[9];
      for (std::size_t a = 0; a < d; ++a)
        for (std::size_t c = 0; c < d; ++c) {
          const bool diagonal = row == column && a == c;
          const bool both = free_.component(static_cast<int>(a))[p] != 0 && free_.component(static_cast<int>(c))[q] != 0;
          block[a * d + c] = both || diagonal ? K.values[(static_cast<std::size_t>(b) * d + a) * d + c] : 0.0;
        }
      visit(number, static_cast<const double*>(block));
    }
  }

  /// values <- those of a field at this rank's unknowns, 0 for prescribed components; and back, 0 elsewhere.
  void gather(ConstFieldView field, double* values) const;
  void scatter(const double* values, FieldView field) const;

 private:
  /// visit(index of the unknown, component, internal index of the point) of this rank's free components.
  template <class Visit>
  void over_free(Visit&& visit) const;

  std::vector<std::int32_t> row_, point_;  ///< of each of this rank's points: the block row of K, the internal index
  std::int64_t before_ = 0, of_all_ = 0;
  Field number_, free_;  ///< of all points here, ghosts too; number -1: without unknowns
};

}  // namespace perikit
