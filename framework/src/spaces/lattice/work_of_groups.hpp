#pragma once
/// What chunks of a lattice have to do where the body has several laws, or points of other ranks: most chunks see one law alone, and
/// ghosts are there for what owned points feel, not for what they feel themselves.

#include <cstdint>
#include <vector>

#include "families/lattice/lattice_families.hpp"
#include "perikit/operators/laws.hpp"

namespace perikit {

struct ChunkRole {
  /// The law of both ends of all bonds that store something, with the same constants everywhere; mixed: they differ.
  static constexpr std::int32_t mixed = -1;
  std::int32_t law = mixed;
  bool bonds = true;       ///< some bond of these points stores something that owned points feel
  bool gradient = true;    ///< such bonds read the gradients of these points
  bool stress = true;      ///< owned points feel the stress on these gradients
  std::int32_t slots = 0;  ///< in ChunkRoles::slots: those whose bonds store something that owned points feel
};

/// Slots that are evaluated together.
struct SlotBatch {
  std::size_t first;
  int count;
};

/// The slots wanted, and few others in between: a batch of many lanes is cheaper than two of few. At most `at_once` in a batch,
/// which has none on both sides of a multiple of it.
std::vector<SlotBatch> slot_batches(const std::vector<bool>& wanted, std::size_t at_once);

/// Marks the points whose stress this rank must compute, by point: 1 where its force is to be complete or it lies within a horizon of such a point, whether a bond leads there or not:
/// the divergence sends along bonds that are cut, too, and takes back what it sent. Of a part of a body.
std::vector<std::uint8_t> affects_owned_points(const LatticeFamilies& families);
/// By row of the divergence: whether one of its points is felt.
std::vector<std::uint8_t> felt_rows(const LatticeFamilies& families, const std::vector<std::uint8_t>& felt);

/// Of kinematics with evaluation points at bonds, which read the gradients of both ends.
struct ChunkRoles {
  /// count: slots of the bonds that chunks evaluate where they scatter; at_once: see slot_batches.
  ChunkRoles(const LatticeFamilies& families, const Laws& laws, std::size_t count, std::size_t at_once);
  std::vector<ChunkRole> chunk;               ///< empty where one law holds everywhere: all chunks are alike
  std::vector<std::uint8_t> rows;             ///< by row of the divergence: whether it has a chunk with `stress`; empty likewise
  std::vector<std::vector<SlotBatch>> slots;  ///< the first: all

  const std::vector<SlotBatch>& slots_of(std::size_t c) const noexcept {
    return slots[chunk.empty() ? 0 : static_cast<std::size_t>(chunk[c].slots)];
  }
  bool wants(std::size_t c, bool ChunkRole::*what) const noexcept { return chunk.empty() || chunk[c].*what; }
  bool wants_row(std::size_t r) const noexcept { return rows.empty() || rows[r] != 0; }
};

/// Of kinematics with evaluation points at points.
struct PointRoles {
  PointRoles(const LatticeFamilies& families, const Laws& laws);
  std::vector<std::int32_t>
      law;  ///< by chunk: of all its points, with the same constants; ChunkRole::mixed: they differ. Empty: one law everywhere
  /// By row: whether owned points feel some of its points; empty: they feel all. All rows of a block that has owned points: its
  /// energy is summed up over rows that are taken together.
  std::vector<std::uint8_t> rows;

  std::int32_t law_of(std::int32_t chunk) const noexcept {
    return law.empty() ? ChunkRole::mixed : law[static_cast<std::size_t>(chunk)];
  }
  bool wants_row(std::size_t r) const noexcept { return rows.empty() || rows[r] != 0; }
};

}  // namespace perikit
