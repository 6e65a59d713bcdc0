#include "fracture/fracture.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <map>

#include "core/each_once.hpp"
#include "fracture/bond_copies.hpp"
#include "fracture/search/bond_criterion.hpp"
#include "fracture/search/bond_monitor.hpp"
#include "perikit/core/communicator.hpp"
#include "perikit/core/field_operations.hpp"
#include "perikit/core/rank_values.hpp"
#include "terms/terms.hpp"

namespace perikit {

namespace {

bool on_any_rank(bool here) {
  return communicator().largest(here ? 1 : 0) > 0;
}

constexpr double retry_later = -1;

/// A bond that stayed for the second law would be tried in vain in most steps: it is where its value comes past another rung of a
/// ladder with eight of them for a factor of two.
bool crosses_retry_threshold(double from, double to, double limit) {
  const auto rung = [&](double value) { return std::floor(8 * std::log2(value / limit)); };
  return rung(from) != rung(to);
}

}  // namespace

Fracture::Fracture(Terms& terms, std::unique_ptr<const BodyDamage> damage)
    : terms_(terms), damage_(std::move(damage)), families_(*terms.parts().families), shared_(families_.body()) {
  const TermParts& parts = terms.parts();
  for (const auto& term : terms.all())
    if (BreakableTerm* const bonds = term->breakable()) breakable_.push_back(bonds);
  const NearestFailure* known = nullptr;
  const double least = std::min(damage_->least_onset(families_.body().internal()), std::numeric_limits<double>::max());
  for (BreakableTerm* const bonds : breakable_)
    if (const NearestFailure* const of_term = damage_->by_stretch() ? bonds->watch(least) : nullptr) known = of_term;
  families_.let_fail();
  if (!damage_->by_stretch()) {
    auto criterion = std::make_unique<BondCriterion>(terms, asked_of_bonds(parts, *damage_->law), damage_.get());
    terms.screen_bonds(criterion->screen());
    finder_ = std::move(criterion);
  } else if (families_.lattice()) {
    finder_ = make_lattice_monitor(*families_.lattice(), *damage_, parts.skip);
  } else {
    finder_ = make_cloud_monitor(*families_.cloud(), *damage_, parts.skip, known);
  }
  if (damage_->gradual()) gradual_.emplace(families_.body(), damage_->crack_speed);
}

Fracture::~Fracture() { terms_.screen_bonds(nullptr); }

std::vector<Fracture::Found> Fracture::found(ConstFieldView before, const Configuration& at) {
  std::vector<Found> all;
  // Bonds that let go in the course of steps, or weaken, do so all through the step.
  for (const BondChange& change : changes_) all.push_back({change, 0.5, 1});
  const bool inside = before.data && !gradual_;
  if (!inside && !damage_->second_law) return all;
  // Energies and stresses are right at the points of this rank: each rank knows the values of bonds that begin there.
  const bool share = shared_.part() && !damage_->by_stretch();
  std::vector<BondId> bonds;
  for (const BondChange& change : changes_)
    if (!share || knows(change.bond)) bonds.push_back(change.bond);
  std::vector<double> start(bonds.size()), end(bonds.size()), moments(bonds.size(), 0.5), excesses(bonds.size());
  if (inside) finder_->values(bonds, at.moved_to(before), start);
  finder_->values(bonds, at, end);
  // Energies grow with the square of what the bonds do.
  const bool square = damage_->law->traits().energy;
  const auto linear = [&](double value) { return square ? std::copysign(std::sqrt(std::abs(value)), value) : value; };
  for (std::size_t k = 0; k < bonds.size(); ++k) {
    const DamageLimits limits = damage_->limits(static_cast<std::size_t>(bonds[k].point), static_cast<std::size_t>(bonds[k].far));
    excesses[k] = end[k] / limits.failure;
    if (!inside) continue;
    const double first = linear(start[k]), last = linear(end[k]);
    const auto crossing = [&](double limit) {
      return first < last ? std::clamp((linear(limit) - first) / (last - first), 0.0, 1.0) : 0.0;
    };
    if (damage_->second_law && start[k] > limits.failure && !crosses_retry_threshold(start[k], end[k], limits.failure))
      moments[k] = retry_later;
    else
      moments[k] = 0.5 * (crossing(limits.onset) + crossing(limits.failure));
  }
  const auto of_all = [&](std::vector<double>& values) {
    if (!share) return;
    std::vector<BondChange> mine;
    for (std::size_t k = 0; k < bonds.size(); ++k) mine.push_back({bonds[k], values[k]});
    std::map<BondId, double> known;   // bonds that let go gradually come in an order of this rank's own
    for (const BondChange& value : shared_.of_all(mine)) known.emplace(value.bond, value.integrity);
    values.clear();
    for (const BondChange& change : changes_) values.push_back(known.at(change.bond));
  };
  of_all(moments);
  of_all(excesses);
  for (std::size_t k = 0; k < all.size(); ++k) {
    all[k].moment = moments[k];
    all[k].excess = excesses[k];
  }
  return all;
}

bool Fracture::knows(BondId bond) const {
  if (!damage_->copies) return families_.body().owns(static_cast<std::size_t>(bond.point));
  std::vector<BondCopies::Copy> copies;
  damage_->copies->find(bond.point, bond.far, copies);
  return damage_->copies->decides(copies);
}

/// Each bond once, where its first point is. Where there are images, bonds count by their ends that are none, so that half of a body has the moments
/// of the whole; all of them alike where there are images alone.
double Fracture::mean_moment(std::span<const Found> found) const {
  const Body& body = families_.body();
  ExactSum sum, of_images;
  std::array<std::int64_t, 2> count{};
  for (const Found& f : found) {
    if (!body.owns(static_cast<std::size_t>(f.change.bond.point))) continue;
    int ends = 0;
    for (const std::int32_t end : {f.change.bond.point, f.change.bond.far}) ends += !body.image(static_cast<std::size_t>(end));
    (ends > 0 ? sum : of_images).add((ends > 0 ? ends : 1) * f.moment);
    count[ends > 0 ? 0 : 1] += ends > 0 ? ends : 1;
  }
  communicator().sum(count);
  if (count[0] > 0) return total_over_ranks(sum) / static_cast<double>(count[0]);
  return count[1] > 0 ? total_over_ranks(of_images) / static_cast<double>(count[1]) : -1;
}

/// Which bonds stay must follow from what they do, not from their places in the body: bonds whose excess is the same but for rounding, as those of
/// points that mirror each other, are one.
Fracture::Ties Fracture::ties(std::span<const Found> found) const {
  constexpr double same = 1e-9;   // relative; rounding changes an excess by far less
  std::vector<double> all;
  for (const Found& f : found)
    if (families_.body().owns(static_cast<std::size_t>(f.change.bond.point))) all.push_back(f.excess);
  if (shared_.part()) all = told_to_all(gathered<double>(all));
  std::ranges::sort(all, std::greater());
  std::vector<double> least;  // of each tie
  for (std::size_t k = 0; k < all.size(); ++k) {
    if (k > 0 && all[k - 1] - all[k] <= same * std::abs(all[k - 1])) least.back() = all[k];
    else least.push_back(all[k]);
  }
  Ties ties(least.size());
  for (const Found& f : found) {
    const auto tie = std::ranges::lower_bound(least, f.excess, std::greater());
    if (tie != least.end()) ties[static_cast<std::size_t>(tie - least.begin())].push_back(f.change);
  }
  return ties;
}

bool Fracture::find(const Configuration& end, double elapsed) {
  ++updates_;
  weakening_.clear();
  settling_.clear();
  ends_.clear();
  changes_ = finder_->find(end);
  // Ranks see what bonds of their own points hold, but all must know which bonds fail.
  if (shared_.part() && !damage_->by_stretch() && on_any_rank(!changes_.empty())) changes_ = shared_.of_all(changes_);
  if (gradual_) changes_ = gradual_->let_go(changes_, elapsed);
  return on_any_rank(!changes_.empty());
}

BondUpdate Fracture::update(const Configuration& at, double elapsed) {
  BondUpdate update;
  if (!find(at, elapsed)) return update;
  if (elapsed > 0) hastened_.forget();
  if (!damage_->law->traits().bits) {
    std::vector<double> from;
    for (const BondChange& change : changes_) from.push_back(families_.integrity(change.bond));
    if (forecasts_) {
      hastened_.accelerate(changes_, from);
    } else {
      settling_ = hastened_.settling(changes_, from);
      for (const BondChange& change : changes_)
        if (change.integrity > 0) weakening_.push_back(change.bond);
    }
  }
  let_fail(found({}, at), at, {}, update);
  finish(update);
  return update;
}

BondImpulse Fracture::fail(bool early, ConstFieldView before, const Configuration& end, double elapsed, BondUpdate& update) {
  if (early) {
    inside_ = found(before, end);
    for (const Found& f : inside_) update.held += f.moment == retry_later && families_.body().owns(static_cast<std::size_t>(f.change.bond.point));
  }
  std::vector<Found> of_half;
  for (const Found& f : inside_) {
    if (f.moment == retry_later || (f.moment < 0.5) != early || families_.integrity(f.change.bond) <= f.change.integrity) continue;
    of_half.push_back(f);
  }
  const double moment = mean_moment(of_half);
  if (moment < 0) return {};
  if (at_.size() == 0)
    for (Field* field : {&at_, &force_}) *field = families_.body().make_field(before.components);
  combine(1 - moment, before, moment, end.u(), at_);
  // The bonds act until they fail, at `moment`. A step has the forces of its beginning for the first half, and those of its end, which are to be
  // without these bonds, for the second: what the bonds owe, or gave too much, is an impulse. It acts where its forces were evaluated, as they have
  // no moment about other positions.
  const double owed = (moment - 0.5) * elapsed;
  if (owed != 0) fill(0.0, force_);
  let_fail(of_half, end.moved_to(at_), owed != 0 ? FieldView(force_) : FieldView{}, update);
  if (owed == 0) return {};
  // Where the second law asks that nothing is gained, energies stay what they are.
  return {force_, owed, moment, damage_->second_law ? 0.0 : (moment - (early ? 0 : 1)) * elapsed * owed};
}

void Fracture::finish(BondUpdate& update) {
  if (gradual_) gradual_->fade(fragments(update.ends));
  if (damage_->second_law) {
    auto held = static_cast<std::int64_t>(update.held);  // of this rank
    communicator().sum({&held, 1});
    update.held = static_cast<std::size_t>(held);
    // A monitor takes it that the bonds that it has named are gone.
    if (held > 0) finder_->forget();
  }
  ends_ = update.ends;
  if (update.dissipated < 0) {
    ++account_.gains;
    account_.gained -= update.dissipated;
  }
  account_.inside_out += update.inside_out;
  account_.held += static_cast<std::int64_t>(update.held);
}

/// Evaluation points may depend on the bonds of the points that they belong to and on no others; else everything in the families of these points counts, too.
MarkedRegion Fracture::dependent_on(std::span<const std::int32_t> ends) const {
  const Formulation& f = terms_.parts().formulation;
  GroupMarks marks = families_.marks_of(ends);
  if (f.dilatation || (f.bond && f.far_share > 0)) families_.mark(ends, marks);
  shared_.mark(marks);
  return {families_, std::move(marks)};
}

void Fracture::bonds_changed(std::span<const std::int32_t> points) {
  for (BreakableTerm* const bonds : breakable_) bonds->bonds_changed(points);
}

void Fracture::let_fail(std::span<const Found> found, const Configuration& at, FieldView force, BondUpdate& update) {
  std::vector<BondChange> changes;
  if (!damage_->second_law) {
    for (const Found& f : found) changes.push_back(f.change);
    return lower(changes, at, force, true, update);
  }
  std::vector<BondChange> before;
  try_to_fail(ties(found), at, changes, before, update);
  // Once more, with forces, and together.
  take_back(before);
  lower(changes, at, force, false, update);
}

/// Lowers bonds, and those of fragments, where the energy at `at` does not rise, and halves of them where it does. lawful: those
/// that were; before: their integrities, and those of the fragments' bonds, in the order in which they fell. All ranks must call
/// it.
void Fracture::try_to_fail(std::span<const std::vector<BondChange>> ties, const Configuration& at, std::vector<BondChange>& lawful,
                           std::vector<BondChange>& before, BondUpdate& update) {
  if (ties.empty()) return;
  std::vector<BondChange> changes;
  for (const std::vector<BondChange>& tie : ties) changes.insert(changes.end(), tie.begin(), tie.end());
  std::vector<BondChange> all = changes, had;
  const std::vector<std::int32_t> ends = lower_with_fragments(all, had);
  bonds_changed(ends);
  const MarkedRegion region = dependent_on(ends);
  const double after = terms_.add_forces(at, region, 0, {});
  take_back(had);
  const double now = terms_.add_forces(at, region, 0, {});
  // Points that are inside out already say nothing.
  if (after <= now || !std::isfinite(now)) {
    bonds_changed(families_.lower(all));
    before.insert(before.end(), had.begin(), had.end());
    lawful.insert(lawful.end(), changes.begin(), changes.end());
    if (std::isfinite(after) && std::isfinite(now)) update.dissipated += now - after;
    return;
  }
  if (ties.size() > 1) {
    const std::size_t half = (ties.size() + 1) / 2;
    try_to_fail(ties.first(half), at, lawful, before, update);
    try_to_fail(ties.subspan(half), at, lawful, before, update);
    return;
  }
  for (const BondChange& change : changes) {
    update.held += families_.body().owns(static_cast<std::size_t>(change.bond.point));
    if (gradual_) gradual_->hold(change.bond, families_.integrity(change.bond));
  }
}

/// before: in the order in which they fell; a bond of a fragment that had weakened fell twice.
void Fracture::take_back(std::span<const BondChange> before) {
  bonds_changed(families_.raise(std::vector<BondChange>(before.rbegin(), before.rend())));
}

std::vector<std::int32_t> Fracture::lower_with_fragments(std::vector<BondChange>& changes, std::vector<BondChange>& before) {
  std::vector<std::int32_t> all;
  for (std::size_t lowered = 0; on_any_rank(lowered < changes.size());) {
    const std::span<const BondChange> next = std::span(changes).subspan(lowered);
    for (const BondChange& change : next) before.push_back({change.bond, families_.integrity(change.bond)});
    const std::vector<std::int32_t> ends = families_.lower(next);
    all.insert(all.end(), ends.begin(), ends.end());
    lowered = changes.size();
    if (gradual_) break;   // bonds of fragments fade
    for (const BondId bond : fragments(ends)) changes.push_back({bond, 0.0});
  }
  keep_each_once(all);
  return all;
}

void Fracture::lower(std::vector<BondChange> changes, const Configuration& at, FieldView force, bool account, BondUpdate& update) {
  if (!on_any_rank(!changes.empty())) return;
  const bool evaluates = force.data || account;
  std::vector<BondChange> before;
  const std::vector<std::int32_t> ends = lower_with_fragments(changes, before);
  if (force.data && part_.size() == 0) part_ = families_.body().make_field(force.components);
  const FieldView part = force.data ? FieldView(part_) : FieldView{};
  MarkedRegion region;
  double stored = 0;
  if (evaluates) {
    // All of them are known now, and those of fragments fall together with those that made them so: between them points that are about to go may be turned
    // inside out.
    take_back(before);
    region = dependent_on(ends);
    if (force.data) fill(0.0, part);
    stored = terms_.add_forces(at, region, 1, part);  // so that what the bonds do not change is gone to the last bit
    families_.lower(changes);
  }
  bonds_changed(ends);
  update.ends.insert(update.ends.end(), ends.begin(), ends.end());
  update.changed += std::max<std::size_t>(before.size(), 1);
  if (!evaluates) return;
  const double left = terms_.add_forces(at, region, -1, part);
  if (!std::isfinite(stored) || !std::isfinite(left)) {
    ++update.inside_out;
    return;
  }
  if (account) update.dissipated += stored - left;
  if (force.data) combine(1, force, 1, part, force);
}

std::vector<BondId> Fracture::fragments(std::span<const std::int32_t> points) const {
  // Others know the whole families of their own points alone.
  std::vector<std::int32_t> own;
  std::ranges::copy_if(points, std::back_inserter(own),
                       [&](std::int32_t p) { return families_.body().owns(static_cast<std::size_t>(p)) && !(damage_->copies && damage_->copies->image(p)); });
  std::vector<BondId> bonds = families_.fragment_bonds(own);
  if (damage_->copies) damage_->copies->add_copies(bonds);
  const Field& limit = damage_->last();
  std::erase_if(bonds, [&](BondId b) { return !std::isfinite(limit.data()[b.point] + limit.data()[b.far]); });
  return shared_.of_all(bonds);
}

void Fracture::restore(std::span<const BondChange> changes) {
  bonds_changed(families_.mend());
  const std::vector<std::int32_t> ends = families_.lower(changes);
  bonds_changed(ends);
  if (gradual_) gradual_->restore(changes, fragments(ends));
  finder_->forget();
  hastened_.forget();
  weakening_.clear();
  settling_.clear();
}

namespace {

/// A family that is left with this share of its influence, and with a shape tensor of this condition, has gradients that are about as stiff as
/// before: half of a family, as it is left beside a crack, is as stiff as a whole one.
constexpr double enough_left = 0.4, round_enough = 4.0;

/// Whether the gradients of the point may have become stiffer than those of whole families.
bool may_be_stiff(const Formulation& f, const Families& families, std::size_t p) {
  if (f.weighted || f.order > 1) return true;   // parts of the family and moments of higher order degenerate before the shape tensor does
  return !(families.remaining_influence(p) > enough_left && families.condition(p) < round_enough);
}

}  // namespace

StiffenedPoints Fracture::stiffened_points() const {
  std::vector<std::int32_t> stiff;
  // Ranks know whole families of their own points alone.
  for (const std::int32_t p : ends_)
    if (families_.body().owns(static_cast<std::size_t>(p)) && may_be_stiff(terms_.parts().formulation, families_, static_cast<std::size_t>(p))) stiff.push_back(p);
  StiffenedPoints points{.inside = shared_.points_beside(stiff), .region = {}};
  if (points.inside.empty()) return points;
  std::vector<std::int32_t> inside;
  for (std::size_t p = 0; p < points.inside.size(); ++p)
    if (points.inside[p]) inside.push_back(static_cast<std::int32_t>(p));
  GroupMarks marks = families_.marks_of(inside);
  for (int k = 1; k < std::max(2, terms_.coupling_reach()); ++k) marks = families_.around(marks);
  points.region = {families_, std::move(marks)};
  return points;
}

}  // namespace perikit
