#pragma once
/// What chunks of a lattice have to do where the body has several laws, or points of other ranks: most chunks see one law alone, and
/// ghosts are there for what owned points feel, not for what they feel themselves.

#include <cstdint>
#include <vector>

#include "families/lattice_families.hpp"
#include "perikit/operators/laws.hpp"

namespace perikit {

struct ChunkRole {
  /// The law of both ends of all bonds that store something, with the same constants everywhere; mixed: they differ.
  static constexpr std::int32_t mixed = -1;
  std::int32_t law = mixed;
  bool bonds = true;     ///< some bond of these points stores something that owned points feel
  bool gradient = true;  ///< such bonds read the gradients of these points
  bool stress = true;    ///< owned points feel the stress on these gradients
};

/// Of kinematics with evaluation points at bonds, which read the gradients of both ends.
struct ChunkRoles {
  ChunkRoles(const LatticeFamilies& families, const Laws& laws);
  std::vector<ChunkRole> chunk;    ///< empty where one law holds everywhere: all chunks are alike
  std::vector<std::uint8_t> rows;  ///< by row of the divergence: whether it has a chunk with `stress`; empty likewise

  bool wants(std::size_t c, bool ChunkRole::*what) const noexcept { return chunk.empty() || chunk[c].*what; }
  bool wants_row(std::size_t r) const noexcept { return rows.empty() || rows[r] != 0; }
};

}  // namespace perikit
