#include "spaces/lattice/work_of_groups.hpp"

#include <algorithm>
#include <bit>
#include <map>

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

}  // namespace

std::vector<std::uint8_t> affects_owned_points(const LatticeFamilies& families) {
  const Body& body = families.body();
  std::vector<std::uint8_t> felt(body.stride(), 0);
  for (const std::int32_t p : body.complete()) {
    felt[static_cast<std::size_t>(p)] = 1;
    for (const std::int64_t shift : families.slots.shifts)
      if (families.live_bits(p + shift) & 1) felt[static_cast<std::size_t>(p + shift)] = 1;
  }
  return felt;
}

std::vector<std::uint8_t> felt_rows(const LatticeFamilies& families, const std::vector<std::uint8_t>& felt) {
  std::vector<std::uint8_t> rows;
  for (const LatticeRow& row : families.tiles.rows) {
    // What comes from the pieces of the row before and after this one to its columns is added up here, too.
    const auto first = felt.begin() + row.first - row.before * chunk_points;
    rows.push_back(std::any_of(first, first + (row.before + row.chunks + row.after) * chunk_points, [](std::uint8_t here) { return here != 0; }));
  }
  return rows;
}

std::vector<SlotBatch> slot_batches(const std::vector<bool>& wanted, std::size_t at_once) {
  constexpr std::size_t least_gap = 3;
  std::vector<SlotBatch> all;
  for (std::size_t slot = 0; slot < wanted.size(); ++slot) {
    if (!wanted[slot]) continue;
    const bool joins = !all.empty() && slot / at_once == all.back().first / at_once &&
                       slot < all.back().first + static_cast<std::size_t>(all.back().count) + least_gap;
    if (!joins) all.push_back({slot, 0});
    all.back().count = static_cast<int>(slot - all.back().first) + 1;
  }
  return all;
}

PointRoles::PointRoles(const LatticeFamilies& families, const Laws& laws) {
  if (laws.single()) return;
  for (const LatticeChunk& chunk : families.tiles.chunks) {
    const unsigned live = families.live_bits(chunk.first);
    const auto first = static_cast<std::size_t>(chunk.first + std::countr_zero(live));
    bool one = !laws.record_of(first).silent;
    for (unsigned lanes = live; lanes != 0; lanes &= lanes - 1)
      one = one && laws.same(first, static_cast<std::size_t>(chunk.first + std::countr_zero(lanes)));
    law.push_back(one ? static_cast<std::int32_t>(&laws.record_of(first) - laws.records().data()) : ChunkRole::mixed);
  }
  if (!laws.has_incomplete_points()) return;
  rows = felt_rows(families, affects_owned_points(families));
  const LatticeTiles& tiles = families.tiles;
  for (const LatticeBlock& block : tiles.blocks) {
    bool owned = false;
    for (std::size_t c = block.chunk_begin; c < block.chunk_end; ++c)
      for (int l = 0; l < chunk_points; ++l)
        owned = owned || (families.live_bits(tiles.chunks[c].first) >> l & 1 &&
                          families.body().owns(static_cast<std::size_t>(tiles.chunks[c].first + l)));
    if (owned)
      std::fill(rows.begin() + static_cast<std::ptrdiff_t>(block.row_begin),
                rows.begin() + static_cast<std::ptrdiff_t>(block.row_end), std::uint8_t{1});
  }
}

ChunkRoles::ChunkRoles(const LatticeFamilies& families, const Laws& laws, std::size_t count, std::size_t at_once)
    : slots{slot_batches(std::vector<bool>(count, true), at_once)} {
  if (laws.single()) return;
  const auto& chunks = families.tiles.chunks;
  const bool ghosts = laws.has_incomplete_points();
  const std::vector<std::uint8_t> felt = ghosts ? affects_owned_points(families) : std::vector<std::uint8_t>();
  const auto stores_nothing = [&](std::size_t p, std::size_t j) {
    if (laws.record_of(p).silent && laws.record_of(j).silent) return true;
    return ghosts && (laws.incomplete(p) || laws.incomplete(j) || (!felt[p] && !felt[j]));
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
      role.gradient = role.gradient || !laws.incomplete(p);
      role.stress = role.stress || felt[p];
    }
  });
  // What points feel on which nobody feels the stress is not asked for: bonds are left that lead from there to others.
  std::map<std::vector<bool>, std::int32_t> known;
  for (std::size_t c = 0; c < chunk.size() && ghosts; ++c) {
    if (chunk[c].stress || !chunk[c].bonds) continue;
    const LatticePattern& pattern = families.pattern(chunks[c]);
    std::vector<bool> wanted(count, false);
    for (std::size_t slot = 0; slot < count; ++slot)
      for (unsigned lanes = pattern.mask[slot]; lanes != 0 && !wanted[slot]; lanes &= lanes - 1) {
        const auto p = static_cast<std::size_t>(chunks[c].first + std::countr_zero(lanes));
        wanted[slot] = !stores_nothing(p, p + static_cast<std::size_t>(families.slots.shifts[slot]));
      }
    const auto [at, fresh] = known.try_emplace(std::move(wanted), static_cast<std::int32_t>(slots.size()));
    if (fresh) slots.push_back(slot_batches(at->first, at_once));
    chunk[c].slots = at->second;
  }
  rows = ghosts ? felt_rows(families, felt) : std::vector<std::uint8_t>(families.tiles.rows.size(), 1);
}

}  // namespace perikit
