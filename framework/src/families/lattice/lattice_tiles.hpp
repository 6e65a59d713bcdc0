#pragma once
/// The points of a lattice in groups of eight, rows and blocks: what loops run over.

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "families/blocks.hpp"
#include "perikit/body/body.hpp"

namespace perikit {

struct LatticeSlots;

inline constexpr int chunk_points = static_cast<int>(padding);

struct LatticeChunk {
  std::int32_t first;                          ///< internal index, a multiple of chunk_points
  std::int32_t pattern;                        ///< of its bonds; -1: whole
};

/// A piece of a row: chunks of cells first ... first + chunk_points * chunks, all of them targets of the divergence. Where it is not the whole
/// row, families reach into so many chunks before it and after it.
struct LatticeRow {
  std::int32_t first;
  std::int32_t chunks;
  std::int32_t k1, k2;
  std::int32_t before = 0, after = 0;
  bool holds(std::int32_t point) const noexcept { return point >= first && point < first + chunks * chunk_points; }
  /// Whether a group of the row is marked; null: all are.
  bool marked(const std::uint8_t* marks) const noexcept {
    const std::int32_t group = first / chunk_points;
    return !marks || std::any_of(marks + group, marks + group + chunks, [](std::uint8_t m) { return m != 0; });
  }
};

struct LatticeBlock {
  std::size_t chunk_begin, chunk_end;          ///< into chunks
  std::size_t row_begin, row_end;              ///< into rows
};

struct LatticeTiles {
  LatticeTiles(const Body& body, const LatticeSlots& slots);

  std::vector<LatticeChunk> chunks;            ///< live ones, block by block, along rows
  std::vector<LatticeRow> rows;
  std::vector<LatticeBlock> blocks;
  BlockReach reach;
  /// By row of cells, k1 + k2 extent[1]: whether forces on some of its points are to be complete here; empty: on all.
  std::vector<std::uint8_t> complete_rows;
  BlockSequence sequence;
  Colouring colouring;

  /// Pieces of PointMotion with all points that a loop over families and their gradients reads or writes for block b.
  std::span<const std::int32_t> pieces(std::size_t b) const noexcept { return pieces_[b]; }
  /// Index into `chunks` of the chunk with this point; -1: none.
  std::int32_t chunk_of(std::int64_t point) const noexcept { return chunk_at_[static_cast<std::size_t>(point) / chunk_points]; }
  /// Whether a point of block b moves.
  bool moves(std::size_t b, ConstFieldView u) const noexcept;
  /// Whether a group of block b is marked.
  bool marked(std::size_t b, const std::uint8_t* marks) const noexcept {
    for (std::size_t c = blocks[b].chunk_begin; c < blocks[b].chunk_end; ++c)
      if (marks[chunks[c].first / chunk_points]) return true;
    return false;
  }
  /// The group of the first chunk of block b, which must have one.
  std::size_t first_group(std::size_t b) const noexcept { return static_cast<std::size_t>(chunks[blocks[b].chunk_begin].first / chunk_points); }
  /// Marks all groups of blocks that have a marked one.
  void complete(GroupMarks& marks) const;
  /// Zero in the rows of block b; in the dead cells of all rows.
  void clear(std::size_t b, FieldView out) const noexcept;
  void clear_dead(FieldView out) const noexcept;
  std::size_t bytes() const noexcept;

 private:
  /// Which tiles a block touches, and its colour. tiles: by block.
  void colour(const LatticeTiling& tiling, const std::vector<std::int32_t>& tiles, const Body& body, const LatticeSlots& slots);

  std::vector<std::vector<std::int32_t>> pieces_;  ///< by block
  std::vector<std::int32_t> chunk_at_;  ///< by group of eight cells
  std::vector<std::pair<std::int32_t, std::uint8_t>>
      partly_dead_;  ///< first cells of such groups in rows, and which of them live
};

}  // namespace perikit
