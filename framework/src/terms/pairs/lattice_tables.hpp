#pragma once
/// Factors on the bonds of a lattice as tables, one for each group of eight points; groups with the same factors share one.

#include <algorithm>
#include <string_view>
#include <unordered_map>

#include "families/lattice/lattice_families.hpp"
#include "perikit/core/parallel.hpp"
#include "terms/pairs/bond_factors.hpp"

namespace perikit {

/// inside: f by slot; usual(chunk): whether all points of a chunk have these; factor(p, slot, far): f of the bond of a point. Where there is no bond, the factor
/// is that of the inside, so that more groups have the same table.
template <class Usual, class Factor>
void make_tables(const LatticeFamilies& families, const std::vector<double>& inside, const Usual& usual, const Factor& factor, BondFactors& out) {
  const std::vector<LatticeChunk>& chunks = families.tiles.chunks;
  const std::size_t slots = families.slots.size();
  AlignedVector<double> common;
  for (std::size_t s = 0; s < slots; ++s) common.insert(common.end(), chunk_points, inside[s]);
  const auto hash = [](const AlignedVector<double>& table) {
    return std::hash<std::string_view>()({reinterpret_cast<const char*>(table.data()), table.size() * sizeof(double)});
  };
  out.tables.push_back(common);
  out.table_of.assign(families.body().stride() / chunk_points, 0);
  std::unordered_multimap<std::size_t, std::int32_t> known;
  known.emplace(hash(common), 0);
  constexpr std::size_t at_once = 256;
  std::vector<AlignedVector<double>> made(at_once);
  std::vector<std::size_t> hashes(at_once);
  for (std::size_t begin = 0; begin < chunks.size(); begin += at_once) {
    const std::size_t end = std::min(chunks.size(), begin + at_once);
    parallel_for(end - begin, [&](std::size_t k) {
      const LatticeChunk& chunk = chunks[begin + k];
      made[k].clear();
      if (usual(chunk)) return;
      made[k] = common;
      const LatticePattern& pattern = families.pattern(chunk);
      for (std::size_t s = 0; s < slots; ++s)
        for (int l = 0; l < chunk_points; ++l) {
          const std::int64_t p = chunk.first + l;
          if (pattern.intact(s, l)) made[k][s * chunk_points + static_cast<std::size_t>(l)] = factor(static_cast<std::size_t>(p), s, static_cast<std::size_t>(p + families.slots.shifts[s]));
        }
      hashes[k] = hash(made[k]);
    });
    for (std::size_t k = 0; k < end - begin; ++k) {
      if (made[k].empty()) continue;
      std::int32_t found = -1;
      for (auto [entry, last] = known.equal_range(hashes[k]); entry != last && found < 0; ++entry)
        if (out.tables[static_cast<std::size_t>(entry->second)] == made[k]) found = entry->second;
      if (found < 0) {
        found = static_cast<std::int32_t>(out.tables.size());
        known.emplace(hashes[k], found);
        out.tables.push_back(made[k]);
      }
      out.table_of[static_cast<std::size_t>(chunks[begin + k].first) / chunk_points] = found;
    }
  }
}

}  // namespace perikit
