#include "spaces/chunk_roles.hpp"

#include <bit>

#include "perikit/core/parallel.hpp"

namespace perikit {

namespace {

/// visit(p, j) of the bonds of a chunk, until it says false.
template <class Visit>
void over_bonds(const LatticeFamilies& families, const LatticeChunk& chunk, Visit&& visit) {
  const LatticePattern& pattern = families.pattern(chunk);
  for (std::size_t slot = 0; slot < families.slots.size(); ++slot)
    for (unsigned lanes = pattern.mask[slot]; lanes != 0; lanes &= lanes - 1) {
      const std::int64_t p = chunk.first + std::countr_zero(lanes);
      if (!visit(static_cast<std::size_t>(p), static_cast<std::size_t>(p + families.slots.shifts[slot]))) return;
    }
}

/// By point: 1 where its force is to be complete or it lies within a horizon of such a point, whether a bond leads there or not: the
/// divergence sends along bonds that are cut, too, and takes back what it sent.
std::vector<std::uint8_t> felt_here(const LatticeFamilies& families) {
  const Body& body = families.body();
  std::vector<std::uint8_t> felt(body.stride(), 0);
  for (const std::int32_t p : body.complete()) {
    felt[static_cast<std::size_t>(p)] = 1;
    for (const std::int64_t shift : families.slots.shifts)
      if (families.live_bits(p + shift) & 1) felt[static_cast<std::size_t>(p + shift)] = 1;
  }
  return felt;
}

}  // namespace

ChunkRoles::ChunkRoles(const LatticeFamilies& families, const Laws& laws) {
  if (laws.single()) return;
  const auto& chunks = families.tiles.chunks;
  const bool ghosts = laws.any_far();
  const std::vector<std::uint8_t> felt = ghosts ? felt_here(families) : std::vector<std::uint8_t>();
  const auto stores_nothing = [&](std::size_t p, std::size_t j) {
    if (laws.record_of(p).silent && laws.record_of(j).silent) return true;
    return ghosts && (laws.far(p) || laws.far(j) || (!felt[p] && !felt[j]));
  };
  chunk.resize(chunks.size());
  parallel_for(chunks.size(), [&](std::size_t c) {
    ChunkRole& role = chunk[c];
    role.bonds = false;
    const MaterialRecord* law = nullptr;
    bool mixed = false;
    over_bonds(families, chunks[c], [&](std::size_t p, std::size_t j) {
      if (stores_nothing(p, j)) return true;
      role.bonds = true;
      const MaterialRecord* const own = &laws.record_of(p);
      mixed = mixed || !laws.same(p, j) || (law && law != own);
      law = own;
      return !mixed;
    });
    // Evaluated as one law, the bonds that store nothing would store something.
    over_bonds(families, chunks[c], [&](std::size_t p, std::size_t j) {
      mixed = mixed || (stores_nothing(p, j) && (laws.record_of(p).silent || laws.record_of(j).silent));
      return !mixed;
    });
    if (law && !mixed) role.law = static_cast<std::int32_t>(law - laws.records().data());
    if (!ghosts) return;
    role.gradient = role.stress = false;
    for (int l = 0; l < chunk_points; ++l) {
      if (!(families.live_bits(chunks[c].first) >> l & 1)) continue;
      const auto p = static_cast<std::size_t>(chunks[c].first + l);
      role.gradient = role.gradient || !laws.far(p);
      role.stress = role.stress || felt[p];
    }
  });
  rows.assign(families.tiles.rows.size(), ghosts ? 0 : 1);
  for (std::size_t r = 0; r < rows.size() && ghosts; ++r) {
    const LatticeRow& row = families.tiles.rows[r];
    for (std::int32_t p = row.first; p < row.first + row.chunks * chunk_points; ++p) rows[r] |= felt[static_cast<std::size_t>(p)];
  }
}

}  // namespace perikit
