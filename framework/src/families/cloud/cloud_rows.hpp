#pragma once
/// What the loops over clouds share: point-major mirrors of fields, and blocks of points.

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "core/operation_counting_row.hpp"
#include "core/ranks/dependent_arrival.hpp"
#include "families/blocks.hpp"
#include "perikit/body/body.hpp"
#include "perikit/core/field.hpp"

namespace perikit {

/// Four doubles: a point-major row, so that one neighbour costs one cache line.
#if defined(PERIKIT_COUNT_OPERATIONS)
using Row = OperationCountingRow;
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

/// All internal indices of a body, in pieces of which what is there arrives from other ranks, or does not.
class ArrivingPieces {
 public:
  explicit ArrivingPieces(const Body& body);

  struct Piece {
    std::int32_t begin, end;
  };
  std::span<const Piece> here() const noexcept { return {pieces_.data(), here_}; }
  std::span<const Piece> arriving() const noexcept { return {pieces_.data() + here_, pieces_.size() - here_}; }
  std::span<const Piece> all() const noexcept { return pieces_; }
  std::size_t size() const noexcept { return size_; }  ///< the stride of the body

 private:
  std::size_t size_;
  std::vector<Piece> pieces_;  ///< those first that are here
  std::size_t here_ = 0;
};

/// A mirror of u at all internal indices, as mirror_rows makes it; of what arrives when it does.
class ArrivingRows final : public DependentArrival {
 public:
  /// first: of u; null: it is there.
  ArrivingRows(const ArrivingPieces& pieces, ConstFieldView u, AlignedVector<Row>& rows, Arrival* first, const double* fourth = nullptr);

 private:
  void put() override;
  void mirror(const ArrivingPieces::Piece& piece) noexcept;

  const ArrivingPieces& pieces_;
  ConstFieldView u_;
  AlignedVector<Row>& rows_;
  const double* fourth_;
};

/// Blocks, and those that hold neighbours of them.
BlockReach cloud_reach(const FamilyLists& families, const CloudBlocks& blocks);
/// The same of the blocks of a body, and which of them hold points of other ranks.
BlockReach cloud_reach(const Body& body, const FamilyLists& families);

/// Colours of these blocks; on a part of a body those that they have in the whole one. Blocks wait for those that write to the same unit of the colours.
Colouring cloud_colouring(const Body& body, const FamilyLists& families, const CloudBlocks& blocks, const BlockReach& reach);

}  // namespace perikit
