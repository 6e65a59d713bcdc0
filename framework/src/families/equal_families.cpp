#include "families/equal_families.hpp"

#include <algorithm>
#include <map>
#include <utility>

namespace perikit {

EqualFamilies::EqualFamilies(const LatticeFamilies& f, BondWeight weight) : of_point(f.body().stride(), -1) {
  std::map<std::pair<std::vector<std::uint16_t>, double>, std::int32_t> known;
  const auto find = [&](const LatticePattern& pattern, int lane) {
    std::vector<std::uint16_t> slots = f.intact_slots(pattern, lane);
    const auto [entry, fresh] = known.try_emplace({slots, pattern.scale_of(weight)[lane]}, static_cast<std::int32_t>(classes.size()));
    if (fresh) {
      // By the step along rows first: bonds whose far ends are next to each other in memory do not follow each other.
      std::stable_sort(slots.begin(), slots.end(),
                       [&](std::uint16_t a, std::uint16_t b) { return f.slots.offsets[a][0] < f.slots.offsets[b][0]; });
      FamilyClass& added = classes.emplace_back();
      for (const std::uint16_t s : slots) added.shifts.push_back(static_cast<std::int32_t>(f.slots.shifts[s]));
      added.slots = std::move(slots);
      added.scale = pattern.scale_of(weight)[lane];
    }
    return entry->second;
  };
  find(f.whole, 0);
  std::vector<std::vector<std::int32_t>> of_lane;
  for (const LatticePattern& pattern : f.patterns) {
    std::vector<std::int32_t>& lanes = of_lane.emplace_back();
    for (int l = 0; l < chunk_points; ++l) lanes.push_back(pattern.live >> l & 1 ? find(pattern, l) : -1);
  }
  for (const LatticeChunk& chunk : f.tiles.chunks)
    for (int l = 0; l < chunk_points; ++l) {
      const std::int32_t own =
          chunk.pattern < 0 ? 0 : of_lane[static_cast<std::size_t>(chunk.pattern)][static_cast<std::size_t>(l)];
      of_point[static_cast<std::size_t>(chunk.first + l)] = own;
      if (own >= 0) ++classes[static_cast<std::size_t>(own)].members;
    }
}

}  // namespace perikit
