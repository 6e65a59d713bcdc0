#pragma once
/// Families on a lattice: one list of offsets for all, and patterns (bond masks and what follows from them) only for chunks of
/// eight points that are not whole. Chunks with the same masks share one pattern.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "families/blocks.hpp"
#include "perikit/body/body.hpp"
#include "perikit/body/influence.hpp"
#include "perikit/families/fracture.hpp"
#include "perikit/model/kinematics.hpp"

namespace perikit {

struct FamilyArrays;

inline constexpr int chunk_points = static_cast<int>(padding);

struct LatticePattern {
  std::vector<std::uint8_t> mask;              ///< [slot]: bit l: the bond of lane l is intact
  alignas(64) double inverse[6][chunk_points]; ///< of K = sum omega d (x) d over intact bonds, d in cells; 0 where singular
  alignas(64) double moment[3][chunk_points];  ///< sum omega d over intact bonds
  alignas(64) double weight[chunk_points];     ///< W_i = V_i (1 - D_i) of the point shape
  alignas(64) double scale[chunk_points];      ///< V_i / N_i of the bond weights, N_i over the intact family
  alignas(64) double damage[chunk_points];     ///< D_i
  alignas(64) double condition[chunk_points];  ///< of K
  alignas(64) double intact[chunk_points];     ///< sum omega over the bonds of the set-up
  alignas(64) double left[chunk_points];       ///< the share of it that is left
  alignas(64) double support[chunk_points];    ///< of K relative to that of the whole family; 1 where nothing is broken
  std::uint8_t live = 0xff;
  std::uint8_t irregular = 0;                  ///< lanes with broken bonds
  std::uint8_t singular = 0;                   ///< live lanes without a regular K
};

struct LatticeChunk {
  std::int32_t first;                          ///< internal index, a multiple of chunk_points
  std::int32_t pattern;                        ///< -1: whole
};

/// A piece of a row: chunks of cells first ... first + chunk_points * chunks, all of them targets of the divergence. Where it is not the whole
/// row, families reach into so many chunks before it and after it.
struct LatticeRow {
  std::int32_t first;
  std::int32_t chunks;
  std::int32_t k1, k2;
  std::int32_t before = 0, after = 0;
  bool holds(std::int32_t point) const noexcept { return point >= first && point < first + chunks * chunk_points; }
};

struct LatticeBlock {
  std::size_t chunk_begin, chunk_end;          ///< into chunks
  std::size_t row_begin, row_end;              ///< into rows
};

/// Rows of offsets (d1, d2) with |d0| <= reach and their weights by |d0|: the first of each mirrored pair.
struct RowPair {
  std::int64_t shift;
  int d1, d2, reach;
  int profile;                                 ///< rows with the same d1^2 + d2^2 share their weights
};

struct RowProfile {
  int reach;
  std::vector<double> omega;                   ///< by |d0|, 0 ... reach
  std::vector<double> omega_d0;                ///< omega times |d0|
};

class LatticeFamilies {
 public:
  /// whole_rows: a block takes in its rows from end to end, however long they are.
  LatticeFamilies(const Body& body, const InfluenceFunction& influence, BondWeight weight, bool whole_rows = false);

  const Body& body;
  const Lattice& lattice;
  double spacing, volume;
  std::vector<std::array<int, 3>> offsets;     ///< by slot; the second half mirrors the first
  std::vector<std::int64_t> shifts;            ///< by slot
  std::vector<double> omega;                   ///< by slot
  std::size_t half = 0;                        ///< slots of one of each pair
  std::vector<RowPair> row_pairs;              ///< without the row (0, 0)
  std::vector<RowProfile> profiles;
  int own_row = -1;                            ///< profile of the row (0, 0); -1: no bond lies in it
  int row_reach = 0;                           ///< largest |d0|
  LatticePattern whole;
  std::vector<LatticePattern> patterns;
  std::vector<LatticeChunk> chunks;            ///< live ones, block by block, along rows
  std::vector<LatticeRow> rows;
  std::vector<LatticeBlock> blocks;
  BlockReach reach;
  Colouring colouring;
  std::size_t bonds = 0, broken = 0, singular = 0;   ///< directed intact bonds; broken ones; points
  std::size_t failed = 0;                      ///< of the broken ones those of `break_bonds`

  const LatticePattern& pattern(const LatticeChunk& chunk) const noexcept {
    return chunk.pattern < 0 ? whole : patterns[static_cast<std::size_t>(chunk.pattern)];
  }
  /// Intact bonds of lane l by slot.
  static bool intact(const LatticePattern& p, std::size_t slot, int lane) noexcept { return p.mask[slot] >> lane & 1; }
  /// Bond vector of a slot, input axes [m].
  std::array<double, 3> bond(std::size_t slot) const noexcept {
    std::array<double, 3> xi{};
    for (std::size_t k = 0; k < 3; ++k) xi[static_cast<std::size_t>(lattice.axis[k])] = offsets[slot][k] * spacing;
    return xi;
  }
  std::vector<std::uint16_t> intact_slots(const LatticePattern& pattern, int lane) const;
  /// The family of the bonds at these slots as arrays; its inverse shape tensor is left alone.
  void load(std::span<const std::uint16_t> slots, FamilyArrays& out) const;
  std::size_t reverse(std::size_t slot) const noexcept { return slot < half ? slot + half : slot - half; }
  /// Index into `chunks` of the chunk with this point; -1: none. Known where rows are split, and after `break_bonds`.
  std::int32_t chunk_of(std::int64_t point) const noexcept { return chunk_at_[static_cast<std::size_t>(point) / chunk_points]; }
  /// Breaks the bonds `slot` at `point` and their reverses. Chunks that they touch get patterns of their own; only the lanes that
  /// they touch are computed anew. Returns the ends, ascending.
  std::vector<std::int32_t> break_bonds(std::span<const BondChange> changes);
  /// The intact bonds of those of the points that are fragments; bonds between two of them twice. After `break_bonds`.
  std::vector<BondChange> fragment_bonds(std::span<const std::int32_t> points) const;
  /// Whether bonds of the point have failed since the set-up.
  bool lost_bonds(std::int32_t point) const noexcept;
  /// The patterns of the set-up. Returns the points whose bonds had been broken.
  std::vector<std::int32_t> mend();
  /// Whether a point of block b moves.
  bool moves(std::size_t b, ConstFieldView u) const noexcept;
  /// Live cells among index ... index + 7.
  std::uint8_t live_bits(std::int64_t index) const noexcept;
  /// K^-1 of a lane with the components of the input axes and the volumes in K [1/m^2 per volume]: what a FamilyView holds.
  void inverse_shape(const LatticePattern& pattern, int lane, double* out) const noexcept;
  std::size_t bytes() const noexcept;

 private:
  void collect_rows();
  void make_blocks(bool whole_rows);
  void make_patterns();
  void index_chunks();
  /// All that follows from the masks, for some of the lanes. set_up: nothing has failed yet.
  void finish_pattern(LatticePattern& pattern, const std::vector<std::uint8_t>& live_mask, bool set_up, unsigned lanes = 0xff) const;
  /// Live cells of a chunk, and for each slot those whose far ends are live too.
  std::uint8_t live_masks(std::int64_t first, std::vector<std::uint8_t>& live_mask) const;
  LatticePattern& own_pattern(LatticeChunk& chunk);

  BondWeight weight_;
  std::size_t shared_ = 0;                     ///< patterns of the set-up; the others belong to one chunk each
  struct Owned {
    std::int32_t chunk, original;              ///< its pattern at the set-up
  };
  std::vector<Owned> owned_;                   ///< of pattern shared_ + k
  std::vector<std::int32_t> chunk_at_;
};

}  // namespace perikit
