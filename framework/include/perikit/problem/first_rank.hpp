#pragma once
/// What one rank has of all of them: fields and matrices of the whole body on rank 0, for what knows no ranks.

#include <cstdint>
#include <span>
#include <vector>

#include "perikit/body/points.hpp"
#include "perikit/core/block_matrix.hpp"
#include "perikit/core/communicator.hpp"
#include "perikit/core/field.hpp"

namespace perikit {

class FirstRank {
 public:
  /// points: those of `all` whose values fields on rank 0 have, each on one rank alone. All ranks must call it, and everything below.
  FirstRank(const Points& all, std::span<const std::int32_t> points);

  /// On rank 0 a field over the whole body from the points of every rank, 0 elsewhere; empty on the others.
  Field gather(ConstFieldView mine) const;
  /// mine <- what is this rank's in a field on rank 0; 0 elsewhere.
  void scatter(ConstFieldView whole, FieldView mine) const;
  /// On rank 0 the rows of every rank, each of those that it owns; without rows on the others. Columns at points that nobody owns, images, are
  /// left out.
  BlockMatrix gather(const BlockMatrix& mine) const;

 private:
  Points all_;
  std::vector<std::int32_t> points_;
  std::vector<std::vector<std::int32_t>> places_;   ///< on rank 0: where those of each rank are in the whole body
};

}  // namespace perikit
