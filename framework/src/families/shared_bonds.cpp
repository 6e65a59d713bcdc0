#include "families/shared_bonds.hpp"

#include <algorithm>
#include <iterator>

#include "perikit/core/rank_values.hpp"

namespace perikit {

/// On rank 0 those of all ranks, by places in the whole body.
std::vector<BondChange> SharedBonds::merged(std::span<const BondChange> mine) const {
  const auto place = body_.places().place;
  std::vector<BondChange> named;
  // Points have the order here that they have in the whole body: the smaller index stays the smaller one.
  for (const auto& [bond, integrity] : mine)
    named.push_back({{place[static_cast<std::size_t>(bond.point)], place[static_cast<std::size_t>(bond.far)]}, integrity});
  std::vector<BondChange> all = gathered<BondChange>(named);
  std::ranges::sort(all, {}, &BondChange::bond);
  const auto rest = std::ranges::unique(all, {}, &BondChange::bond);
  all.erase(rest.begin(), rest.end());
  return all;
}

double SharedBonds::name(BondId bond) const noexcept {
  const auto place = [&](std::int32_t p) { return part() ? body_.places().place[static_cast<std::size_t>(p)] : p; };
  const std::size_t stride = part() ? body_.places().stride : body_.stride();
  return static_cast<double>(place(bond.point)) * static_cast<double>(stride) + static_cast<double>(place(bond.far));
}

void SharedBonds::find_here() const {
  if (!here_.empty()) return;
  here_.assign(body_.places().stride, -1);
  for (const std::int32_t p : body_.internal())
    here_[static_cast<std::size_t>(body_.places().place[static_cast<std::size_t>(p)])] = p;
}

void SharedBonds::mark(GroupMarks& marks) const {
  if (!part()) return;
  std::vector<std::int32_t> mine;
  for (const std::int32_t p : body_.internal())
    if (marks[static_cast<std::size_t>(p) / padding]) mine.push_back(body_.places().place[static_cast<std::size_t>(p)]);
  find_here();
  for (const std::int32_t place : told_to_all(gathered<std::int32_t>(mine)))
    if (const std::int32_t p = here_[static_cast<std::size_t>(place)]; p >= 0) marks[static_cast<std::size_t>(p) / padding] = 1;
}

std::vector<BondChange> SharedBonds::outward(std::span<const BondChange> changes) const {
  if (!part()) return {changes.begin(), changes.end()};
  std::vector<BondChange> own;
  std::ranges::copy_if(changes, std::back_inserter(own),
                       [&](const BondChange& change) { return body_.owns(static_cast<std::size_t>(change.bond.point)); });
  return merged(own);
}

std::vector<BondChange> SharedBonds::inward(std::span<const BondChange> changes) const {
  if (!part()) return {changes.begin(), changes.end()};
  find_here();
  std::vector<BondChange> in;
  for (const auto& [bond, integrity] : changes) {
    const BondId own{here_[static_cast<std::size_t>(bond.point)], here_[static_cast<std::size_t>(bond.far)]};
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
