#include "fracture/shared_bonds.hpp"

#include <algorithm>

#include "core/each_once.hpp"
#include "perikit/core/rank_values.hpp"

namespace perikit {

/// Points have the order here that they have in the whole body: the smaller index stays the smaller one.
NamedChange SharedBonds::named(const BondChange& change) const noexcept {
  return {{place(change.bond.point), place(change.bond.far)}, change.integrity};
}

/// On rank 0 those of all ranks, by places in the whole body.
std::vector<NamedChange> SharedBonds::merged(std::span<const BondChange> mine) const {
  std::vector<NamedChange> named;
  for (const BondChange& change : mine) named.push_back(this->named(change));
  std::vector<NamedChange> all = gathered<NamedChange>(named);
  keep_each_once(all, &NamedChange::bond);
  return all;
}

void SharedBonds::mark(GroupMarks& marks) const {
  if (!part()) return;
  std::vector<std::int64_t> mine;
  for (const std::int32_t p : body_.internal())
    if (marked(marks, static_cast<std::size_t>(p))) mine.push_back(place(p));
  for (const std::int64_t there : told_to_all(gathered<std::int64_t>(mine)))
    if (const std::int32_t p = body_.at_place(there); p >= 0) perikit::mark(marks, static_cast<std::size_t>(p));
  if (body_.lattice()) mark_whole_runs(1, marks);
}

std::vector<std::uint8_t> SharedBonds::points_beside(std::span<const std::int32_t> points) const {
  constexpr auto group = static_cast<std::int64_t>(padding);
  std::vector<std::int64_t> groups;
  for (const std::int32_t p : points) groups.push_back(place(p) / group);
  if (part()) groups = told_to_all(gathered<std::int64_t>(groups));
  keep_each_once(groups);
  if (groups.empty()) return {};
  std::vector<std::uint8_t> marks(body_.stride(), 0);
  for (const std::int64_t g : groups)
    for (std::int64_t at = g * group; at < (g + 1) * group; ++at) {
      const std::int64_t p = part() ? body_.at_place(at) : at;
      if (p >= 0 && body_.alive(static_cast<std::size_t>(p))) marks[static_cast<std::size_t>(p)] = 1;
    }
  return marks;
}

std::vector<NamedChange> SharedBonds::outward(std::span<const BondChange> changes) const {
  std::vector<NamedChange> own;
  for (const BondChange& change : changes)
    if (!part() || body_.owns(static_cast<std::size_t>(change.bond.point))) own.push_back(named(change));
  return own;
}

std::vector<BondChange> SharedBonds::inward(std::span<const NamedChange> changes) const {
  const auto here = [&](std::int64_t place) { return part() ? body_.at_place(place) : static_cast<std::int32_t>(place); };
  std::vector<BondChange> in;
  for (const auto& [bond, integrity] : changes) {
    const BondId own{here(bond.point), here(bond.far)};
    if (own.point >= 0 && own.far >= 0) in.push_back({own, integrity});
  }
  return in;
}

std::vector<BondId> SharedBonds::of_all(std::span<const BondId> bonds) const {
  if (!part()) return {bonds.begin(), bonds.end()};
  std::vector<BondChange> mine;
  for (const BondId bond : bonds) mine.push_back({bond, 0.0});
  std::vector<BondId> here;
  for (const BondChange& change : of_all(mine)) here.push_back(change.bond);
  return here;
}

std::vector<BondChange> SharedBonds::of_all(std::span<const BondChange> changes) const {
  if (!part()) return {changes.begin(), changes.end()};
  return inward(told_to_all(merged(changes)));
}

}  // namespace perikit
