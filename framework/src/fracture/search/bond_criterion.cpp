#include "fracture/search/bond_criterion.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "cloud_balance/consistency.hpp"
#include "core/each_once.hpp"
#include "families/bond_stretch.hpp"
#include "families/cloud/cloud_families.hpp"
#include "fracture/search/bond_energy_split.hpp"
#include "perikit/core/parallel.hpp"

namespace perikit {

namespace {

/// Directed bonds that are sampled at a time.
constexpr std::size_t most_at_once = std::size_t{1} << 19;
/// The criterion of what bonds set free asks for stored energy, too: a bond fails where one of its own two evaluation points, or where these belong to points
/// one of either end, holds per volume this part of what would be needed if bonds set free what they hold. What a bond sets free is not bounded by what it
/// holds, so that this is no saving without consequences but a part of the criterion, with run.skip = false as well: see
/// framework/docs/decisions/0021-what-bonds-set-free.md.
double least_held(const Formulation& formulation) noexcept { return formulation.bond && formulation.g_from_xi_only ? 0.25 : 0.125; }
constexpr double infinite = std::numeric_limits<double>::infinity();

}  // namespace

BondCriterion::BondCriterion(const Terms& terms, DamageTraits asked, const BodyDamage* damage)
    : families_(*terms.parts().families),
      body_(families_.body()),
      formulation_(terms.parts().formulation),
      shares_(formulation_, families_, terms.parts().factors.get()),
      damage_(damage),
      copies_(damage ? damage->copies.get() : nullptr),
      terms_(terms.all()),
      skip_(terms.parts().skip),
      traits_(asked),
      by_point_(!formulation_.pairs && formulation_.parts(body_.dimension()) > 0),
      samples_(body_.space(), traits_.released ? BondSampling::derivative : traits_.stress ? BondSampling::stress : BondSampling::energy) {
  const auto image = [&](std::int32_t p) { return body_.image(static_cast<std::size_t>(p)); };
  if (traits_.released) release_.emplace(terms.parts(), copies_ || std::ranges::any_of(body_.internal(), image));
  const std::size_t count = body_.stride() / padding;
  for (std::size_t g = 0; g < count; ++g) {
    // Of the copies of a bond one rank decides, by whichever of their ends is near failure.
    bool any = false;
    for (std::size_t l = 0; l < padding; ++l) any |= body_.alive(g * padding + l) && (copies_ || body_.owns(g * padding + l));
    if (any) groups_.push_back(static_cast<std::int32_t>(g));
  }
  own_.assign(count, 0);
  looked_at_.assign(count, whole_group);
  if (damage && traits_.bound != ValueBound::none) set_screen(terms.parts().consistency ? std::span<const double>(terms.parts().consistency->factors) : std::span<const double>());
}

/// Each term may have the same part of what a point holds.
/// Proof that no bond beyond its limit is left out of a look by what bonds hold: a bond holds psi_ij/N_i + psi_ji/N_j over its share, N the
/// normaliser of its share, psi with its factor, and fails where this sum is above the limit. Then one of the two psi is above half of the limit times
/// its N, which is the density beyond which the bond is named, or its owner marked.
void BondCriterion::set_screen(std::span<const double> factors) {
  const BondWeight kind = by_point_ ? BondWeight::kernel : formulation_.weight;
  const Field& onset = damage_->onset;
  FamilyArrays family;
  AlignedVector<double> share;
  screen_.limit = damage_->least_onset(body_.internal());
  // A bond to an image stores half of what it holds.
  if (copies_ && formulation_.pairs) screen_.limit *= 0.5;
  screen_.over_share = traits_.bound == ValueBound::energy_over_share;
  screen_.near.assign(body_.stride() / padding, 0);
  screen_.density.assign(body_.stride(), infinite);
  if (formulation_.pairs) {
    for (const std::int32_t p : copies_ ? body_.internal() : std::span(body_.owned()))   // a bond may be met at its end that is an image
      if (onset.data()[p] < infinite) screen_.density[static_cast<std::size_t>(p)] = 0;
    return;
  }
  double most = 1;
  if (!screen_.over_share) {
    most = 0;
    families_.each_class([&](std::span<const std::int32_t> points) {
      families_.load(static_cast<std::size_t>(points[0]), BondsOf::uncut, family);
      shares_.of_point(static_cast<std::size_t>(points[0]), family, share);
      for (std::size_t k = 0; k < family.far.size(); ++k) most = std::max(most, share[k]);
    });
  }
  const auto own = [&](std::int32_t p) {
    return (release_ ? least_held(formulation_) : 1.0) * 0.5 * (1 - 1e-9) * screen_.limit * families_.normaliser(static_cast<std::size_t>(p), kind) /
           (most * static_cast<double>(terms_.size()));
  };
  if (by_point_) {
    const auto parts = static_cast<std::size_t>(formulation_.parts(body_.dimension()));
    const auto largest_factor = [&](std::size_t p) { return factors.empty() ? 1.0 : std::max(1.0, std::ranges::max(factors.subspan(p * parts, parts))); };
    for (const std::int32_t p : copies_ ? body_.internal() : std::span(body_.owned()))   // another rank's points may speak for a bond that this one decides
      if (onset.data()[p] < infinite) screen_.density[static_cast<std::size_t>(p)] = own(p) / largest_factor(static_cast<std::size_t>(p));
    return;
  }
  screen_.with_factors = !release_;
  screen_.of_bonds.assign(body_.stride(), infinite);
  for (const std::int32_t p : body_.internal())
    if (onset.data()[p] < infinite) screen_.of_bonds[static_cast<std::size_t>(p)] = own(p);
  for (const std::int32_t p : body_.internal()) {
    const auto at = static_cast<std::size_t>(p);
    if (onset.data()[at] == infinite) continue;
    screen_.density[at] = screen_.of_bonds[at];
    families_.load(at, BondsOf::uncut, family);
    for (const std::int32_t far : family.far) screen_.density[at] = std::min(screen_.density[at], screen_.of_bonds[static_cast<std::size_t>(far)]);
  }
}

BondScreen* BondCriterion::screen() noexcept {
  return screen_.near.empty() || !(skip_ || release_) ? nullptr : &screen_;
}

/// Statics look for bonds at displacements that need not be those of their last evaluation.
void BondCriterion::mark_by_forces(const Configuration& at) {
  const ConstFieldView u = at.u();
  if (!screen() || screen_.known_at(u)) return;
  clear_forces(u.components);
  screen_.begin();
  for (const auto& term : terms_)
    if (term->forces(at.moved_to(u), {}, {.force = forces_, .screen = &screen_}) >= 0) return;
  screen_.end(u);
}

void BondCriterion::clear_forces(int components) {
  if (forces_.size() == 0) forces_ = body_.make_field(components);
  std::fill_n(forces_.data(), forces_.size(), 0.0);
}

/// The bonds that may fail, by the last forces, where evaluation points belong to bonds.
void BondCriterion::name_near_failure() {
  for (const auto& of_thread : screen_.bonds) named_.insert(named_.end(), of_thread.begin(), of_thread.end());
  // Terms beside them know points alone.
  FamilyArrays family;
  for (const std::int32_t p : body_.internal()) {
    if (!marked(screen_.near, static_cast<std::size_t>(p))) continue;
    families_.load(static_cast<std::size_t>(p), BondsOf::intact, family);
    for (const std::int32_t far : family.far) named_.push_back(BondId::of(p, far));
  }
  if (copies_) {
    keep_each_once(named_);
    copies_->add_copies(named_);
    return;
  }
  std::erase_if(named_, [&](BondId b) { return !body_.owns(static_cast<std::size_t>(b.point)); });   // their owners look at them
  keep_each_once(named_);
}

/// Those of these groups, by their lower ends.
std::span<const BondId> BondCriterion::named_in(std::int32_t first_group, std::int32_t last_group) const noexcept {
  const auto group = [](BondId b) { return b.point / static_cast<std::int32_t>(padding); };
  return {std::ranges::lower_bound(named_, first_group, {}, group), std::ranges::upper_bound(named_, last_group, {}, group)};
}

/// The points with bonds that may fail at u.
GroupMarks BondCriterion::near_failure(const Configuration& at) {
  const bool known = screen_.known_at(at.u());
  if (known && terms_.size() == 1) return screen_.near;
  if (!by_point_ || screen_.near.empty()) return known ? screen_.near : GroupMarks(own_.size(), whole_group);
  // What points hold of all terms is cheaper than a look at their bonds.
  const BondSampling asked = samples_.what();
  samples_.ask(BondSampling::energy);
  collect(at, known ? families_.evaluated(screen_.near) : GroupMarks(screen_.near.size(), whole_group), {});
  GroupMarks near(screen_.near.size(), 0);
  for (const BondSamples::Entry& entry : samples_.entries()) {
    const auto p = static_cast<std::size_t>(entry.owner);
    const double left = body_.volume(p) * (1 - families_.damage(p));
    if (left > 0 && entry.energy > left * screen_.density[p] * static_cast<double>(terms_.size())) mark(near, p);
  }
  samples_.ask(asked);
  return near;
}

void BondCriterion::look_at_named() {
  looked_at_.assign(own_.size(), 0);
  for (const BondId bond : named_) {
    mark(looked_at_, static_cast<std::size_t>(bond.point));
    // Pair laws say what bonds of marked points hold, and a copy has the first end of another one there.
    if (copies_ && formulation_.pairs) mark(looked_at_, static_cast<std::size_t>(bond.far));
  }
}

std::vector<std::int32_t> BondCriterion::groups_with(const GroupMarks& marks) const {
  std::vector<std::int32_t> groups;
  for (const std::int32_t g : groups_)
    if (marks[static_cast<std::size_t>(g)]) groups.push_back(g);
  return groups;
}

/// The points of these groups whose evaluation points tell of the bonds that are looked at.
GroupMarks BondCriterion::looked_at(std::span<const std::int32_t> groups) const {
  GroupMarks marks(own_.size(), 0);
  for (const std::int32_t g : groups) marks[static_cast<std::size_t>(g)] = looked_at_[static_cast<std::size_t>(g)];
  return families_.evaluated(std::move(marks));
}

/// What the evaluation points of these points hold, and those of the far ends of the bonds that are looked at.
void BondCriterion::sample(std::span<const std::int32_t> groups, const Configuration& at) {
  if (groups.empty()) return;
  own_ = looked_at(groups);
  sampled_ = own_;
  if (copies_) {
    copies_->add_copies(sampled_);
    sampled_ = families_.evaluated(std::move(sampled_));
  }
  if (flux_.flux.data) {
    samples_.ask(BondSampling::energy);
    return collect(at, own_, own_);
  }
  if (formulation_.pairs) return collect(at, sampled_, sampled_);  // both ends at once
  if (named_.empty()) {
    near_ = families_.around(sampled_);
  } else {
    const auto of_groups = named_in(groups.front(), groups.back());
    std::vector<BondId> bonds(of_groups.begin(), of_groups.end());
    if (copies_) copies_->add_copies(bonds);
    std::vector<std::int32_t> ends;
    for (const BondId bond : bonds) ends.insert(ends.end(), {bond.point, bond.far});
    near_ = families_.marks_of(ends);
  }
  if (!release_) return collect(at, near_, sampled_);
  samples_.ask(BondSampling::derivative);
  const GroupMarks owners = release_->reach() > 1 ? families_.around(near_) : near_;
  collect(at, owners, near_);
  release_->find(at.u(), near_, owners, {sampled_, named_}, samples_);
}

void BondCriterion::find_flux(std::span<const std::int32_t> groups, const Configuration& at) {
  if (!release_ || copies_ || !release_->follows_from_flux() || groups.empty()) return;
  const ConstFieldView u = at.u();
  BreakableTerm& bonds = *terms_.front()->breakable();
  if (screen_.known_at(u)) flux_ = bonds.point_flux();
  if (flux_.everywhere) return;
  flux_ = {};
  // The points of their families, and whatever has a bond with those.
  const MarkedRegion region(families_, families_.around(families_.around(looked_at(groups))));
  clear_forces(u.components);
  if (terms_.front()->forces(at.moved_to(u), region, {forces_}) < 0) flux_ = bonds.point_flux();
}

/// Of the evaluation points of these owners; kept: see BondSamples::clear.
void BondCriterion::collect(const Configuration& at, const GroupMarks& owners, const GroupMarks& kept) {
  const GroupMarks wide = families_.around(owners);
  samples_.clear(kept);
  if (formulation_.pairs) samples_.want(looked_at_);  // of others evaluation points are those of groups
  for (const auto& term : terms_)
    if (BreakableTerm* const bonds = term->breakable()) bonds->add_bonds(at, {&owners, &wide}, samples_);
  samples_.merge();
}

template <class Visit>
void BondCriterion::by_pieces(std::span<const std::int32_t> groups, const Configuration& at, Visit&& visit) {
  while (static_cast<int>(memory_.size()) < thread_count()) memory_.push_back(std::make_unique<Bonds>());
  const std::size_t bonds_each = std::max<std::size_t>(1, families_.bonds() / std::max<std::size_t>(1, groups_.size()));
  const std::size_t piece = by_point_ ? groups.size() : std::max<std::size_t>(1, most_at_once / bonds_each);
  for (std::size_t first = 0; first < groups.size(); first += piece) {
    const auto of_piece = groups.subspan(first, std::min(piece, groups.size() - first));
    sample(of_piece, at);
    visit(of_piece);
  }
  checked_ += groups.size();
}

/// w_ij of a bond with integrity b: see BondStates::energy.
double BondCriterion::energy_of(std::int32_t p, std::int32_t far, double b, double whole_omega) const noexcept {
  const double volumes = body_.volume(static_cast<std::size_t>(p)) * body_.volume(static_cast<std::size_t>(far));
  double energy = 0;
  for (const auto& [owner, other] : {std::pair(p, far), std::pair(far, p)}) {
    const BondSamples::Entry* const of_bond = by_point_ ? nullptr : samples_.find(owner, other);
    if (of_bond) energy += of_bond->energy / (b * volumes);
    if (samples_.both_ways()) {
      if (of_bond) return energy;
      continue;   // of a copy the other end may be the one that was asked for
    }
    if (samples_.of_bonds_alone()) continue;
    const BondSamples::Entry* of_point = samples_.find(owner, -1);
    const auto i = static_cast<std::size_t>(owner);
    const double left = (1 - families_.damage(i)) * families_.normaliser(i, BondWeight::kernel);
    if (of_point && left > 0) energy += of_point->energy * whole_omega / (left * body_.volume(i));
  }
  return energy;
}

void BondCriterion::add_stress(std::int32_t owner, std::int32_t far, std::int32_t turned_by, double& weight, double* stress) const noexcept {
  const BondSamples::Entry* entry = samples_.find(owner, by_point_ ? -1 : far);
  if (!entry || entry->weight <= 0) return;
  // Of points the mean, of bonds the mean by weight.
  const double factor = by_point_ ? 1 / entry->weight : 1.0;
  double turned[6];
  std::copy_n(entry->tensor, 6, turned);
  if (copies_) copies_->turn_stress(turned_by, turned);
  weight += factor * entry->weight;
  for (std::size_t c = 0; c < 6; ++c) stress[c] += factor * turned[c];
}

void BondCriterion::load(std::int32_t p, ConstFieldView u, std::span<const BondId> named, Bonds& m) const {
  families_.load(static_cast<std::size_t>(p), BondsOf::intact, m.family);
  m.place.clear();
  for (std::size_t k = 0; k < m.family.far.size(); ++k) {
    const std::int32_t far = m.family.far[k];
    // A bond is looked at once: at its lower end, or at the one whose group is looked at.
    const bool here = named.empty() ? p < far || !looks_at(static_cast<std::size_t>(far))
                                    : std::ranges::binary_search(named, BondId{p, far});
    if (here && (!copies_ || stands_for_copies(p, far, m))) m.place.push_back(k);
  }
  const std::size_t n = m.place.size(), size = padded(n);
  for (auto* array : {&m.length, &m.stretch, &m.share, &m.energy, &m.value, &m.onset, &m.failure, &m.integrity})
    array->assign(size, 1.0);
  m.stress.assign(traits_.stress ? 6 * size : 0, 0.0);
  shares_.of_point(static_cast<std::size_t>(p), m.family, m.all_shares);
  if (flux_.flux.data) release_->of(p, m.family, m.place, u, flux_, samples_, m.energy.data());
  for (std::size_t k = 0; k < n; ++k) {
    const std::int32_t far = m.family.far[m.place[k]];
    const double volumes = body_.volume(static_cast<std::size_t>(p)) * body_.volume(static_cast<std::size_t>(far));
    m.length[k] = m.family.length[m.place[k]];
    m.stretch[k] = bond_stretch(m.family, m.place[k], static_cast<std::size_t>(p), u);
    m.share[k] = m.all_shares[m.place[k]];
    if (flux_.flux.data)
      m.energy[k] /= volumes;
    else if (release_)
      m.energy[k] = (release_->of(p, far) + release_->of(far, p)) / volumes;
    else if (traits_.energy)
      m.energy[k] = energy_of(p, far, m.family.b(m.place[k]), m.family.whole_omega(m.place[k]));
    if (traits_.stress) {
      double weight = 0, stress[6] = {};
      for (const auto& [owner, other] : {std::pair(p, far), std::pair(far, p)}) add_stress(owner, other, p, weight, stress);
      for (std::size_t c = 0; c < 6 && weight > 0; ++c) m.stress[c * size + k] = stress[c] / weight;
    }
    if (copies_) take_copies(p, k, u, m);
  }
  if (!damage_) return;
  for (std::size_t k = 0; k < n; ++k) {
    const DamageLimits limits = damage_->limits(static_cast<std::size_t>(p), static_cast<std::size_t>(m.family.far[m.place[k]]));
    m.onset[k] = limits.onset;
    m.failure[k] = limits.failure;
  }
  if (n == 0) return;
  damage_->law->measure({static_cast<int>(n), m.length.data(), m.stretch.data(), m.share.data(),
                         traits_.energy ? m.energy.data() : nullptr, traits_.stress ? m.stress.data() : nullptr, size,
                         m.value.data()});
}

template <class Visit>
void BondCriterion::bonds_of(std::int32_t group, ConstFieldView u, Visit&& visit) {
  Bonds& m = *memory_[static_cast<std::size_t>(thread_index())];
  for (std::size_t l = 0; l < padding; ++l) {
    const std::size_t p = static_cast<std::size_t>(group) * padding + l;
    if (!body_.alive(p) || !looks_at(p)) continue;
    const auto first = std::ranges::lower_bound(named_, static_cast<std::int32_t>(p), {}, &BondId::point),
               last = std::ranges::upper_bound(named_, static_cast<std::int32_t>(p), {}, &BondId::point);
    load(static_cast<std::int32_t>(p), u, {first, last}, m);
    if (!m.place.empty()) visit(static_cast<std::int32_t>(p), m);
  }
}

std::vector<BondChange> BondCriterion::find(const Configuration& at) {
  const ConstFieldView u = at.u();
  std::vector<BondChange> all;
  found_.clear();
  found_at_ = u.data;
  if (release_) mark_by_forces(at);
  named_.clear();
  const bool by_bond = (skip_ || release_) && screen_.by_bond() && screen_.known_at(u);
  if (by_bond) {
    name_near_failure();
    look_at_named();
  } else {
    looked_at_ = skip_ || release_ ? near_failure(at) : GroupMarks(own_.size(), whole_group);
    if (copies_) copies_->add_copies(looked_at_);
  }
  const std::vector<std::int32_t> near = groups_with(looked_at_);
  find_flux(near, at);
  by_pieces(near, at, [&](std::span<const std::int32_t> groups) {
    std::vector<std::vector<Found>> found(groups.size());
    parallel_for(groups.size(), [&](std::size_t g) {
      bonds_of(groups[g], u, [&](std::int32_t p, Bonds& m) {
        damage_->law->integrity(
            {static_cast<int>(m.place.size()), m.value.data(), m.onset.data(), m.failure.data(), m.integrity.data()});
        for (std::size_t k = 0; k < m.place.size(); ++k)
          if (m.integrity[k] < m.family.b(m.place[k]))
            found[g].push_back({{BondId::of(p, m.family.far[m.place[k]]), m.integrity[k]}, m.value[k]});
      });
    });
    for (const auto& of_group : found) found_.insert(found_.end(), of_group.begin(), of_group.end());
  });
  flux_ = {};
  // Where a bond lies in two pieces it was found in both.
  const auto bond = [](const Found& f) { return f.change.bond; };
  keep_each_once(found_, bond);
  if (copies_) find_copies();
  for (const Found& f : found_) all.push_back(f.change);
  return all;
}

void BondCriterion::values(std::span<const BondId> bonds, const Configuration& at, std::span<double> values) {
  const ConstFieldView u = at.u();
  const auto known = [&](BondId bond) {
    const auto first = std::ranges::lower_bound(found_, bond, {}, [](const Found& f) { return f.change.bond; });
    return first != found_.end() && first->change.bond == bond ? &*first : nullptr;
  };
  // Another rank may have found a bond that was not looked at here.
  if (u.data == found_at_ && std::ranges::all_of(bonds, known)) {
    for (std::size_t k = 0; k < bonds.size(); ++k) values[k] = known(bonds[k])->value;
    return;
  }
  while (static_cast<int>(memory_.size()) < thread_count()) memory_.push_back(std::make_unique<Bonds>());
  std::vector<BondId> first(bonds.begin(), bonds.end());  // of their copies
  std::vector<BondCopies::Copy> copies;
  for (BondId& bond : first) {
    if (!copies_) break;
    copies_->find(bond.point, bond.far, copies);
    bond = BondCopies::first(copies).bond();
  }
  std::vector<std::int32_t> groups;
  for (const BondId bond : first) groups.push_back(bond.point / static_cast<std::int32_t>(padding));
  keep_each_once(groups);
  named_ = first;
  if (copies_) copies_->add_copies(named_);
  else std::ranges::sort(named_);
  look_at_named();
  find_flux(groups, at);
  sample(groups, at);
  Bonds& m = *memory_[0];
  for (std::size_t k = 0; k < bonds.size(); ++k) {
    load(first[k].point, u, {&first[k], 1}, m);
    values[k] = m.place.empty() ? 0.0 : m.value[0];
  }
  flux_ = {};
}

std::vector<BondEnergy> BondCriterion::energies(const Configuration& at) {
  const ConstFieldView u = at.u();
  std::vector<BondEnergy> all;
  looked_at_.assign(own_.size(), whole_group);
  named_.clear();
  find_flux(groups_, at);
  by_pieces(groups_, at, [&](std::span<const std::int32_t> groups) {
    std::vector<std::vector<BondEnergy>> found(groups.size());
    parallel_for(groups.size(), [&](std::size_t g) {
      bonds_of(groups[g], u, [&](std::int32_t p, Bonds& m) {
        for (std::size_t k = 0; k < m.place.size(); ++k) {
          const std::int32_t far = m.family.far[m.place[k]];
          found[g].push_back({BondId::of(p, far), m.energy[k] * (release_ ? 1.0 : m.family.b(m.place[k])) *
                                                      body_.volume(static_cast<std::size_t>(p)) * body_.volume(static_cast<std::size_t>(far))});
        }
      });
    });
    for (const auto& of_group : found) all.insert(all.end(), of_group.begin(), of_group.end());
  });
  flux_ = {};
  keep_each_once(all, &BondEnergy::bond);
  return all;
}

std::vector<BondEnergy> bond_energies(const Terms& terms, const Configuration& at, bool released) {
  if (const char* const reason = released ? BondRelease::unknown(terms.parts()) : nullptr)
    throw std::logic_error(fmt::format("what bonds set free is not known {}", reason));
  return BondCriterion(terms, {.energy = true, .released = released}, nullptr).energies(at);
}

}  // namespace perikit
