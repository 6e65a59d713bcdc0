/// Which points a weighted space takes together, and the stencils that it stores for them.

#include <algorithm>
#include <map>
#include <numeric>

#include <fmt/format.h>

#include "spaces/weighted/weighted.hpp"

namespace perikit {

template <int D>
Weighted<D>::Weighted(const SpaceParts& parts)
    : families_(parts.families), lattice_(families_.lattice()), cloud_(families_.cloud()), body_(families_.body()), formulation_(parts.formulation),
      laws_(parts.laws), rules_{&formulation_, body_.horizon()}, selective_(formulation_.selective()),
      // Local force states have no common adjoint: every point makes its own stencil.
      share_(parts.share && formulation_.force_state == ForceState::variational), owners_(selective_ ? 1 : 0), parts_(formulation_.parts(D)), pieces_(body_) {
  lattice_ ? prepare_lattice() : prepare_cloud();
  const BlockReach reach = lattice_ ? lattice_->tiles.reach : cloud_reach(body_, cloud_->lists());
  if (cloud_) cloud_colouring_ = cloud_colouring(body_, cloud_->lists(), CloudBlocks(body_), reach);
  quiet_ = parts.quiet_blocks(reach);
  singles_ = std::any_of(groups_.begin(), groups_.end(), [](const Group& g) { return g.stencil < 0; });
  if (!parts.numbered()) return;
  number_groups();
  place_points();
}

template <int D>
void Weighted<D>::prepare_lattice() {
  EqualFamilies found(*lattice_, formulation_.weight);
  classes_ = std::move(found.classes);
  const std::vector<std::int32_t> stencil_of = store_stencils();
  for (const LatticeBlock& block : lattice_->tiles.blocks) {
    block_first_.push_back(groups_.size());
    // By class, in the order of their first points: the numbers of classes depend on what else a rank has.
    std::map<std::int32_t, std::size_t> known;
    std::vector<std::pair<std::int32_t, std::vector<std::int32_t>>> members;
    for (std::size_t c = block.chunk_begin; c < block.chunk_end; ++c)
      for (int l = 0; l < chunk_points; ++l) {
        const std::int32_t p = lattice_->tiles.chunks[c].first + l, family = found.of_point[static_cast<std::size_t>(p)];
        if (family < 0) continue;
        const auto [entry, fresh] = known.try_emplace(family, members.size());
        if (fresh) members.push_back({family, {}});
        members[entry->second].second.push_back(p);
      }
    for (const auto& [family, points] : members) group_points(points, family, stencil_of[static_cast<std::size_t>(family)]);
  }
  block_first_.push_back(groups_.size());
}

template <int D>
std::vector<std::int32_t> Weighted<D>::store_stencils() {
  std::vector<std::int32_t> stencil_of(classes_.size(), -1);
  std::vector<std::size_t> order(classes_.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return classes_[a].members > classes_[b].members; });
  std::size_t bytes = 0;
  Memory m;
  for (const std::size_t k : order) {
    const FamilyClass& family = classes_[k];
    if (family.members == 0 || family.slots.empty()) continue;
    load_class(static_cast<std::int32_t>(k), m);
    build(m, 0, nullptr);
    fallbacks_ += static_cast<std::size_t>(m.stencil.fallbacks()) * family.members;
    dropped_ += static_cast<std::size_t>(m.stencil.dropped()) * family.members;
    if (!share_ || bytes > stencil_bytes || (parts_ == 0 && family.members < fewest_together)) continue;
    stencil_of[k] = static_cast<std::int32_t>(stencils_.size());
    bytes += stencils_.emplace_back(m.family, m.stencil, owners_, parts_ == 0).bytes();
  }
  return stencil_of;
}

template <int D>
void Weighted<D>::group_points(std::span<const std::int32_t> points, std::int32_t family, std::int32_t stencil) {
  if (classes_[static_cast<std::size_t>(family)].slots.empty()) return;
  const auto add = [&](std::span<const std::int32_t> group, bool contiguous) {
    groups_.push_back({static_cast<std::uint32_t>(members_.size()), family, stencil, static_cast<std::uint8_t>(group.size()), contiguous});
    members_.insert(members_.end(), group.begin(), group.end());
    if (stencil >= 0) members_.insert(members_.end(), 8 - group.size(), group[0]);
  };
  const auto add_singly = [&](std::span<const std::int32_t> rest) {
    stencil = -1;
    for (const std::int32_t& p : rest) add({&p, 1}, false);
  };
  if (stencil < 0) return add_singly(points);
  // Eight in a row need no gathers; the others of the block are put together as they come.
  std::vector<std::int32_t> rest;
  for (std::size_t i = 0; i < points.size();) {
    if (i + 8 <= points.size() && points[i + 7] == points[i] + 7) {
      add(points.subspan(i, 8), true);
      i += 8;
    } else {
      rest.push_back(points[i++]);
    }
  }
  for (std::size_t i = 0; i < rest.size(); i += 8) {
    const std::span<const std::int32_t> some = std::span(rest).subspan(i, std::min<std::size_t>(8, rest.size() - i));
    if (parts_ == 0 && some.size() < fewest_together) add_singly(some);
    else add(some, false);
  }
}

template <int D>
void Weighted<D>::prepare_cloud() {
  const std::size_t together = parts_ > 0 ? 8 : 1;
  const CloudBlocks blocks(body_);
  for (std::size_t p = 0; p < body_.points(); ++p) {
    if (p % blocks.size() == 0) block_first_.push_back(groups_.size());
    if (cloud_->neighbours(p).empty()) continue;
    if (groups_.size() == block_first_.back() || groups_.back().count == together)
      groups_.push_back({static_cast<std::uint32_t>(members_.size()), -1, -1, 0, false});
    ++groups_.back().count;
    members_.push_back(static_cast<std::int32_t>(p));
  }
  block_first_.push_back(groups_.size());
  make_cloud_stencils();
}

template <int D>
void Weighted<D>::shift_gradients(ConstFieldView lambda) {
  rules_.shift = lambda;
  if (parts_ > 0) make_cloud_stencils();  // others make theirs when they need it
}

template <int D>
void Weighted<D>::make_cloud_stencils() {
  std::vector<std::size_t> fallbacks(blocks(), 0), dropped(blocks(), 0);
  if (parts_ > 0) sparse_.assign(blocks(), {});
  remade_.clear();
  parallel_for(blocks(), [&](std::size_t b) {
    Memory m;
    const auto member = [&](std::size_t g) { return g < groups_.size() ? groups_[g].first : members_.size(); };
    for (std::size_t i = member(block_first_[b]); i < member(block_first_[b + 1]); ++i) {
      const auto p = static_cast<std::size_t>(members_[i]);
      load_family(p, BondsOf::set_up, m);
      build(m, 0, nullptr);
      fallbacks[b] += static_cast<std::size_t>(m.stencil.fallbacks());
      dropped[b] += static_cast<std::size_t>(m.stencil.dropped());
      if (parts_ > 0) sparse_[b].append(m.stencil, cloud_->neighbours(p));
    }
  });
  fallbacks_ = std::accumulate(fallbacks.begin(), fallbacks.end(), std::size_t{0});
  dropped_ = std::accumulate(dropped.begin(), dropped.end(), std::size_t{0});
}

template <int D>
void Weighted<D>::number_groups() {
  for (const Group& group : groups_) {
    number_.push_back(numbers_);
    const std::size_t bonds = lattice_ ? classes_[static_cast<std::size_t>(group.family)].slots.size()
                                       : cloud_->neighbours(static_cast<std::size_t>(members_[group.first])).size();
    numbers_ += 8 * (parts_ > 0 ? static_cast<std::size_t>(parts_) : bonds);
  }
}

template <int D>
void Weighted<D>::place_points() {
  place_.assign(body_.stride(), {});
  left_.resize(blocks());
  for (std::size_t b = 0; b < blocks(); ++b)
    for (std::size_t g = block_first_[b]; g < block_first_[b + 1]; ++g)
      for (std::uint8_t l = 0; l < groups_[g].count; ++l)
        place_[static_cast<std::size_t>(members_[groups_[g].first + l])] = {static_cast<std::uint32_t>(b), static_cast<std::uint32_t>(g), l, false};
}

template <int D>
void Weighted<D>::bonds_changed(std::span<const std::int32_t> points) {
  if (place_.empty()) place_points();
  if (!sparse_.empty()) remade_.resize(body_.stride());
  for (const std::int32_t p : points) {
    if (!remade_.empty()) remade_[static_cast<std::size_t>(p)].reset();
    // Families that are whole again return: a restored space is bitwise a new one.
    Place& place = place_[static_cast<std::size_t>(p)];
    if (place.left == families_.lost_bonds(static_cast<std::size_t>(p))) continue;
    place.left = !place.left;
    groups_[place.group].live ^= static_cast<std::uint8_t>(1u << place.lane);
    std::vector<std::int32_t>& left = left_[place.block];
    const auto entry = std::lower_bound(left.begin(), left.end(), p);
    if (place.left) left.insert(entry, p);
    else left.erase(entry);
    singles_ = true;
  }
}

template <int D>
void Weighted<D>::load_class(std::int32_t family, Memory& m) const {
  const FamilyClass& own = classes_[static_cast<std::size_t>(family)];
  lattice_->load(own.slots, m.family);
  m.share.assign(m.family.size, 0.0);
  for (std::size_t k = 0; k < own.slots.size(); ++k) m.share[k] = own.scale * (formulation_.weight == BondWeight::kernel ? m.family.omega[k] : 1.0);
}

template <int D>
void Weighted<D>::load_family(std::size_t p, BondsOf which, Memory& m) const {
  families_.load(p, which, m.family);
  bond_shares(families_, p, formulation_.weight, m.family, m.share);
}

template <int D>
void Weighted<D>::report(ModelReport& report) const {
  report.fallbacks += fallbacks_;
  report.dropped_parts += dropped_;
  report.evaluation_points += parts_ > 0 ? body_.points() * static_cast<std::size_t>(parts_) : families_.bonds();
  std::size_t stencils = 0, together = 0;
  for (const MirroredStencil<D>& s : stencils_) stencils += s.bytes();
  for (const SparseStencils<D>& s : sparse_) report.bytes += s.bytes();
  for (const auto& stencil : remade_) report.bytes += sizeof(stencil) + (stencil ? stencil->bytes() : 0);
  for (const Group& group : groups_) together += group.stencil >= 0 ? group.count : 0;
  report.bytes += stencils + groups_.size() * sizeof(Group) + number_.size() * sizeof(std::size_t) + members_.size() * sizeof(std::int32_t) + place_.size() * sizeof(Place) +
                  (u_rows_.size() + w_rows_.size() + out_rows_.size()) * sizeof(Row) + scratch_.bytes();
  if (stencils_.empty()) return;
  const auto slots = static_cast<double>(lattice_->slots.size());
  const double whole = 8.0 * D * slots * (parts_ > 0 ? parts_ : slots) * static_cast<double>(body_.points());
  report.skips.push_back({"stencils of equal families",
                          fmt::format("{} stored for {} of {} points, by characters of their mirrors", stencils_.size(), together, body_.points()),
                          megabytes(static_cast<double>(stencils)) + " stored instead of " + megabytes(whole)});
}

#define PERIKIT_INSTANTIATE(D)                                                          \
  template Weighted<D>::Weighted(const SpaceParts&);                                    \
  template void Weighted<D>::shift_gradients(ConstFieldView);                           \
  template void Weighted<D>::bonds_changed(std::span<const std::int32_t>);              \
  template void Weighted<D>::load_class(std::int32_t, Memory&) const;                   \
  template void Weighted<D>::load_family(std::size_t, BondsOf, Memory&) const;          \
  template void Weighted<D>::report(ModelReport&) const;
PERIKIT_INSTANTIATE(1)
PERIKIT_INSTANTIATE(2)
PERIKIT_INSTANTIATE(3)
#undef PERIKIT_INSTANTIATE

}  // namespace perikit
