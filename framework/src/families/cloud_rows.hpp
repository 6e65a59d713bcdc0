#pragma once
/// What the loops over clouds share: point-major mirrors of fields, and blocks of points.

#include <algorithm>

#include "families/blocks.hpp"
#include "families/counted_row.hpp"
#include "perikit/body/body.hpp"
#include "perikit/core/field.hpp"

namespace perikit {

/// Four doubles: a point-major row, so that one neighbour costs one cache line.
#if defined(PERIKIT_COUNT_OPERATIONS)
using Row = CountedRow;
#else
typedef double Row __attribute__((vector_size(32)));
#endif

/// Pieces of so many points that follow each other; of a cloud: the blocks that its loops run over.
class CloudBlocks {
 public:
  CloudBlocks() = default;
  CloudBlocks(std::size_t points, std::size_t size) : points_(points), size_(size) {}
  explicit CloudBlocks(const Body& body) : CloudBlocks(body.points(), body.block_points()) {}
  std::size_t count() const noexcept { return (points_ + size_ - 1) / size_; }
  std::size_t size() const noexcept { return size_; }
  std::size_t begin(std::size_t b) const noexcept { return b * size_; }
  std::size_t end(std::size_t b) const noexcept { return std::min(points_, (b + 1) * size_); }
  std::size_t of(std::size_t point) const noexcept { return point / size_; }
  /// Whether a point of block b moves.
  bool moves(ConstFieldView u, std::size_t b) const noexcept;
  /// body(p) for all points of all blocks, in parallel.
  template <class Use>
  void over_points(Use&& use) const {
    parallel_for(count(), [&](std::size_t b) {
      for (std::size_t p = begin(b); p < end(b); ++p) use(p);
    });
  }

 private:
  std::size_t points_ = 0, size_ = 256;
};

/// For loops over points that leave each other alone.
inline CloudBlocks pieces_of(std::size_t points) noexcept { return {points, 256}; }

/// rows[p] <- components of u at p, zero in the rest, and fourth[p] in the last place where it is given.
void mirror_rows(ConstFieldView u, std::size_t points, AlignedVector<Row>& rows, const double* fourth = nullptr);

/// Blocks, and those that hold neighbours of them.
BlockReach cloud_reach(const FamilyLists& families, const CloudBlocks& blocks);

/// Colours of these blocks; on a part of a body those that they have in the whole one. Blocks wait for those that write to the same eight points.
Colouring cloud_colouring(const Body& body, const FamilyLists& families, const CloudBlocks& blocks, const BlockReach& reach);

}  // namespace perikit
