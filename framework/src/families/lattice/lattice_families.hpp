#pragma once
/// Families on a lattice: one list of offsets for all, and patterns (bond masks and what follows from them) only for chunks of
/// eight points that are not whole. Chunks with the same masks share one pattern.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "families/families.hpp"
#include "families/lattice/lattice_slots.hpp"
#include "families/lattice/lattice_tiles.hpp"
#include "perikit/core/simd.hpp"

namespace perikit {

struct LatticePattern {
  std::vector<std::uint8_t> mask;              ///< [slot]: bit l: the bond of lane l is intact, b > 0
  AlignedVector<double> integrity;             ///< b: [slot][lane], 0 where it is not intact; empty where every b is 0 or 1
  alignas(64) double inverse[6][chunk_points]; ///< of K = sum omega d (x) d over intact bonds, d in cells; 0 where singular
  alignas(64) double moment[3][chunk_points];  ///< sum omega d over intact bonds
  alignas(64) double weight[chunk_points];     ///< W_i = V_i (1 - D_i) of the point shape
  alignas(64) double scale[2][chunk_points];   ///< V_i / N_i by BondWeight, N_i over the uncut family
  alignas(64) double damage[chunk_points];     ///< D_i
  alignas(64) double condition[chunk_points];  ///< of K
  alignas(64) double intact_at_set_up[chunk_points];   ///< sum omega over its bonds then
  alignas(64) double left[chunk_points];       ///< the share of it that is left
  std::uint8_t live = 0xff;
  std::uint8_t irregular = 0;                  ///< lanes with bonds that are not whole
  std::uint8_t singular = 0;                   ///< live lanes without a gradient
  std::uint8_t fragment = 0;                   ///< lanes that failed bonds have left with less than least_support

  bool intact(std::size_t slot, int lane) const noexcept { return mask[slot] >> lane & 1; }
  double b(std::size_t slot, int lane) const noexcept {
    return !intact(slot, lane) ? 0.0 : integrity.empty() ? 1.0 : integrity[slot * chunk_points + static_cast<std::size_t>(lane)];
  }
  /// b of the lanes of a slot, chunk_points of them.
  const double* b_of(std::size_t slot) const noexcept;
  const double (&scale_of(BondWeight kind) const noexcept)[chunk_points] { return scale[kind == BondWeight::kernel]; }
};

class LatticeFamilies final : public Families {
 public:
  LatticeFamilies(const Body& body, std::shared_ptr<const InfluenceFunction> influence, FamilyNeeds needs);

  const LatticeFamilies* lattice() const noexcept override { return this; }
  void load(std::size_t p, BondsOf which, FamilyArrays& out) const override;
  void each_class(const std::function<void(std::span<const std::int32_t>)>& visit) const override;
  double damage(std::size_t p) const noexcept override { return pattern_at(p).damage[p % chunk_points]; }
  double remaining_influence(std::size_t p) const noexcept override { return pattern_at(p).left[p % chunk_points]; }
  double condition(std::size_t p) const noexcept override { return pattern_at(p).condition[p % chunk_points]; }
  double normaliser(std::size_t p, BondWeight kind) const noexcept override;
  bool lost_bonds(std::size_t p) const noexcept override;
  double integrity(BondId bond) const noexcept override;
  std::vector<BondChange> changed() const override;
  void mark(std::span<const std::int32_t> points, GroupMarks& marks) const override;
  std::size_t bytes() const noexcept override;

  const Lattice& grid;
  double spacing, volume;
  LatticeSlots slots;
  LatticeTiles tiles;
  LatticePattern whole;
  std::vector<LatticePattern> patterns;

  const LatticePattern& pattern(const LatticeChunk& chunk) const noexcept { return pattern(chunk.pattern); }
  const LatticePattern& pattern(std::int32_t index) const noexcept { return index < 0 ? whole : patterns[static_cast<std::size_t>(index)]; }
  const LatticePattern& pattern_at(std::size_t point) const noexcept { return pattern(tiles.chunks[static_cast<std::size_t>(tiles.chunk_of(static_cast<std::int64_t>(point)))]); }
  /// The pattern of a chunk at the set-up.
  const LatticePattern& set_up_pattern(const LatticeChunk& chunk) const noexcept;
  std::vector<std::uint16_t> intact_slots(const LatticePattern& pattern, int lane) const;
  /// The family of whole bonds at these slots, seen from the cell 0; its inverse shape tensor is left alone.
  void load(std::span<const std::uint16_t> slots, FamilyArrays& out) const;
  /// Bonds that are broken, by pre-cracks or since: loops that take every family for whole have to be corrected.
  bool any_broken() const noexcept { return cut_ > 0 || !owned_.empty(); }
  /// Points without a gradient, or with less of it than at the set-up.
  bool any_weak() const noexcept { return singular_ > 0 || !owned_.empty(); }
  /// Live cells among index ... index + 7.
  std::uint8_t live_bits(std::int64_t index) const noexcept;
  /// K^-1 of a lane with the components of the input axes and the volumes in K [1/m^2 per volume]: what a FamilyView holds.
  void inverse_shape(const LatticePattern& pattern, int lane, double* out) const noexcept;

 private:
  void make_patterns();
  /// Takes the bonds that pre-cracks cut out of the masks of a chunk. Returns its lanes with such bonds.
  std::uint8_t cut_bonds(const LatticeChunk& chunk, std::uint8_t live, std::vector<std::uint8_t>& mask);
  /// All that follows from the masks, for some of the lanes. set_up: nothing has failed yet.
  void finish_pattern(LatticePattern& pattern, const std::vector<std::uint8_t>& live_mask, bool set_up, unsigned lanes = 0xff) const;
  /// Live cells of a chunk, and for each slot those whose far ends are live too.
  std::uint8_t live_masks(std::int64_t first, std::vector<std::uint8_t>& live_mask) const;
  LatticePattern& own_pattern(LatticeChunk& chunk);
  /// Lanes with a bond between live points that is not whole.
  unsigned broken_lanes(const LatticePattern& pattern, const std::vector<std::uint8_t>& live_mask) const;
  std::vector<std::int32_t> set_bonds(std::span<const BondChange> changes) override;
  std::vector<std::int32_t> mend_bonds() override;
  void make_room() override {}
  bool is_fragment(std::size_t p) const noexcept override { return pattern_at(p).fragment >> p % chunk_points & 1; }

  struct Owned {
    std::int32_t chunk, original;              ///< its pattern at the set-up
  };
  std::size_t shared_ = 0;                     ///< patterns of the set-up; the others belong to one chunk each
  std::vector<Owned> owned_;                   ///< of pattern shared_ + k
};

/// 1 in the lanes of a mask, 0 elsewhere: [mask][lane].
struct LaneFactors {
  alignas(64) double value[256][chunk_points]{};
  constexpr LaneFactors() {
    for (int m = 0; m < 256; ++m)
      for (int l = 0; l < chunk_points; ++l) value[m][l] = (m >> l & 1) ? 1.0 : 0.0;
  }
  constexpr const double (&operator[](std::size_t mask) const noexcept)[chunk_points] { return value[mask]; }
};
inline constexpr LaneFactors lane_factors;

inline const double* LatticePattern::b_of(std::size_t slot) const noexcept {
  return integrity.empty() ? lane_factors[mask[slot]] : integrity.data() + slot * static_cast<std::size_t>(chunk_points);
}

}  // namespace perikit
