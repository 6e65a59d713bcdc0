#include "fracture/fracture.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <map>

#include "core/each_once.hpp"
#include "fracture/bond_copies.hpp"
#include "perikit/core/communicator.hpp"
#include "perikit/core/field_operations.hpp"
#include "perikit/core/rank_values.hpp"

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

Fracture::Fracture(Families& families, const BodyDamage& damage, std::unique_ptr<BondFinder> finder)
    : families_(families), damage_(damage), shared_(families.body()), finder_(std::move(finder)) {
  if (damage.gradual()) gradual_.emplace(families.body(), damage.crack_speed);
}

std::vector<Fracture::Found> Fracture::found(std::span<const BondChange> changes, ConstFieldView before, const Configuration& at) {
  std::vector<Found> all;
  // Bonds that let go in the course of steps, or weaken, do so all through the step.
  for (const BondChange& change : changes) all.push_back({change, 0.5, 1});
  const bool inside = before.data && !gradual_;
  if (!inside && !damage_.second_law) return all;
  // Energies and stresses are right at the points of this rank: each rank knows the values of bonds that begin there.
  const bool share = shared_.part() && !damage_.by_stretch();
  std::vector<BondId> bonds;
  for (const BondChange& change : changes)
    if (!share || knows(change.bond)) bonds.push_back(change.bond);
  std::vector<double> start(bonds.size()), end(bonds.size()), moments(bonds.size(), 0.5), excesses(bonds.size());
  if (inside) finder_->values(bonds, at.moved_to(before), start);
  finder_->values(bonds, at, end);
  // Energies grow with the square of what the bonds do.
  const bool square = damage_.law->traits().energy;
  const auto linear = [&](double value) { return square ? std::copysign(std::sqrt(std::abs(value)), value) : value; };
  for (std::size_t k = 0; k < bonds.size(); ++k) {
    const DamageLimits limits = damage_.limits(static_cast<std::size_t>(bonds[k].point), static_cast<std::size_t>(bonds[k].far));
    excesses[k] = end[k] / limits.failure;
    if (!inside) continue;
    const double first = linear(start[k]), last = linear(end[k]);
    const auto crossing = [&](double limit) {
      return first < last ? std::clamp((linear(limit) - first) / (last - first), 0.0, 1.0) : 0.0;
    };
    if (damage_.second_law && start[k] > limits.failure && !crosses_retry_threshold(start[k], end[k], limits.failure))
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
    for (const BondChange& change : changes) values.push_back(known.at(change.bond));
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
  if (!damage_.copies) return families_.body().owns(static_cast<std::size_t>(bond.point));
  std::vector<BondCopies::Copy> copies;
  damage_.copies->find(bond.point, bond.far, copies);
  return damage_.copies->decides(copies);
}

/// Each bond once, where its first point is. Where there are images, bonds count by their ends that are none, so that half of a body has the moments
/// of the whole; all of them alike where there are images alone.
double Fracture::mean_moment(std::span<const Found> found) const {
  const perikit::Body& body = families_.body();
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

BondUpdate Fracture::update(const Configuration& at, double elapsed, const StepInside& step, const Body& body) {
  const ConstFieldView u = at.u();
  ++updates_;
  weakening_.clear();
  settling_.clear();
  std::vector<BondChange> changes = finder_->find(at);
  // Ranks see what bonds of their own points hold, but all must know which bonds fail.
  if (shared_.part() && !damage_.by_stretch() && on_any_rank(!changes.empty())) changes = shared_.of_all(changes);
  if (gradual_) changes = gradual_->let_go(changes, elapsed);
  if (!on_any_rank(!changes.empty())) return {};
  BondUpdate update;
  if (!step) {
    if (elapsed > 0) hastened_.forget();
    if (!damage_.law->traits().bits) {
      std::vector<double> from;
      for (const BondChange& change : changes) from.push_back(families_.integrity(change.bond));
      if (forecasts_) {
        hastened_.accelerate(changes, from);
      } else {
        settling_ = hastened_.settling(changes, from);
        for (const BondChange& change : changes)
          if (change.integrity > 0) weakening_.push_back(change.bond);
      }
    }
    fail(found(changes, {}, at), at, {}, body, update);
    finish(update);
    return update;
  }
  if (before_.size() == 0)
    for (Field* field : {&before_, &at_, &force_}) *field = families_.body().make_field(u.components);
  step.begin(before_);
  const std::vector<Found> all = found(changes, before_, at);
  for (const Found& f : all)
    update.held += f.moment == retry_later && families_.body().owns(static_cast<std::size_t>(f.change.bond.point));
  // Those of each half of the step at the mean of their moments.
  for (const bool early : {true, false}) {
    std::vector<Found> of_half;
    for (const Found& f : all) {
      if (f.moment == retry_later || (f.moment < 0.5) != early || families_.integrity(f.change.bond) <= f.change.integrity) continue;
      of_half.push_back(f);
    }
    const double moment = mean_moment(of_half);
    if (moment < 0) continue;
    if (!early) step.begin(before_);   // points that lost bonds were elsewhere
    combine(1 - moment, before_, moment, u, at_);
    // The bonds act until they fail, at `moment`. A step has the forces of its beginning for the first half, and those of its end, which are to be
    // without these bonds, for the second: what the bonds owe, or gave too much, is an impulse. It acts where its forces were evaluated, as they have
    // no moment about other positions.
    const double owed = (moment - 0.5) * elapsed, end = early ? 0 : 1;
    if (owed != 0) fill(0.0, force_);
    fail(of_half, at.moved_to(at_), owed != 0 ? FieldView(force_) : FieldView{}, body, update);
    if (owed == 0) continue;
    const double growth = step.act(force_, owed, moment);
    // It works at the velocity of its moment, and in the balance of a step at that of the end of the step that it belongs to. Where the second law
    // asks that nothing is gained, energies stay what they are.
    if (!damage_.second_law) update.dissipated -= (moment - end) * elapsed * owed * growth;
  }
  finish(update);
  return update;
}

std::vector<double> Fracture::integrities(std::span<const BondId> bonds, const Configuration& at) {
  const std::size_t size = padded(bonds.size());
  AlignedVector<double> value(size, 0.0), onset(size, 1.0), failure(size, 1.0), left(size, 1.0);
  finder_->values(bonds, at, {value.data(), bonds.size()});
  for (std::size_t k = 0; k < bonds.size(); ++k) {
    const DamageLimits limits = damage_.limits(static_cast<std::size_t>(bonds[k].point), static_cast<std::size_t>(bonds[k].far));
    onset[k] = limits.onset;
    failure[k] = limits.failure;
  }
  damage_.law->integrity({static_cast<int>(bonds.size()), value.data(), onset.data(), failure.data(), left.data()});
  return {left.begin(), left.begin() + static_cast<std::ptrdiff_t>(bonds.size())};
}

bool Fracture::add_weakening(const Configuration& at, ConstFieldView w, FieldView force, const Body& body) {
  const double length = largest_magnitude(w);
  if (weakening_.empty() || length < std::numeric_limits<double>::min()) return true;   // the step would be infinite
  // Central differences: points move by the cube root of the rounding unit times the spacing.
  const double step = std::cbrt(std::numeric_limits<double>::epsilon()) * families_.body().spacing() / length;
  const ConstFieldView u = at.u();
  Field beside = families_.body().make_field(u.components);
  combine(1, u, step, w, beside);
  std::vector<double> slope = integrities(weakening_, at.moved_to(beside));
  combine(1, u, -step, w, beside);
  const std::vector<double> behind = integrities(weakening_, at.moved_to(beside));
  double largest = 0;
  for (std::size_t k = 0; k < slope.size(); ++k) {
    slope[k] = (slope[k] - behind[k]) / (2 * step);
    largest = std::max(largest, std::abs(slope[k]));
  }
  if (largest < std::numeric_limits<double>::min()) return true;
  const double change = 1e-6 / largest;
  std::vector<BondChange> before, after;
  for (std::size_t k = 0; k < slope.size(); ++k) {
    const double b = families_.integrity(weakening_[k]);
    if (b == 0) continue;
    before.push_back({weakening_[k], b});
    after.push_back({weakening_[k], std::clamp(b + change * slope[k], 0.5 * b, 1.0)});
  }
  if (before.empty()) return true;
  std::vector<std::int32_t> ends;
  for (const BondChange& bond : before) ends.insert(ends.end(), {bond.bond.point, bond.bond.far});
  const GroupMarks marks = dependent_on(ends, body);
  const bool known = std::isfinite(body.forces(at, marks, -1 / change, force));
  body.changed(families_.lower(after));
  const bool still = std::isfinite(body.forces(at, marks, 1 / change, force));
  body.changed(families_.raise(before));
  return known && still;
}

BondUpdate Fracture::weaken(const Configuration& at, ConstFieldView forecast, const Body& body) {
  const std::vector<double> ahead = integrities(settling_, at.moved_to(forecast));
  std::vector<BondChange> changes;
  for (std::size_t k = 0; k < settling_.size(); ++k) {
    const double now = families_.integrity(settling_[k]), then = std::max(ahead[k], AitkenAcceleration::least_left * now);
    if (then < now) changes.push_back({settling_[k], then});
  }
  BondUpdate update;
  if (changes.empty()) return update;
  fail(found(changes, {}, at), at, {}, body, update);
  finish(update);
  return update;
}

void Fracture::finish(BondUpdate& update) {
  if (gradual_) gradual_->fade(fragments(update.ends));
  if (!damage_.second_law) return;
  auto held = static_cast<std::int64_t>(update.held);  // of this rank
  communicator().sum({&held, 1});
  update.held = static_cast<std::size_t>(held);
  // A monitor takes it that the bonds that it has named are gone.
  if (held > 0) finder_->forget();
}

/// Groups whose evaluation points depend on the bonds of these points; on all ranks the same.
GroupMarks Fracture::dependent_on(std::span<const std::int32_t> ends, const Body& body) const {
  GroupMarks marks = families_.marks_of(ends);
  if (!body.owners_alone) families_.mark(ends, marks);
  shared_.mark(marks);
  return marks;
}

void Fracture::fail(std::span<const Found> found, const Configuration& at, FieldView force, const Body& body, BondUpdate& update) {
  std::vector<BondChange> changes;
  if (!damage_.second_law) {
    for (const Found& f : found) changes.push_back(f.change);
    return lower(changes, at, force, true, body, update);
  }
  std::vector<BondChange> before;
  try_to_fail(ties(found), at, body, changes, before, update);
  // Once more, with forces, and together.
  take_back(before, body);
  lower(changes, at, force, false, body, update);
}

/// Lowers bonds, and those of fragments, where the energy at `at` does not rise, and halves of them where it does. lawful: those
/// that were; before: their integrities, and those of the fragments' bonds, in the order in which they fell. All ranks must call
/// it.
void Fracture::try_to_fail(std::span<const std::vector<BondChange>> ties, const Configuration& at, const Body& body, std::vector<BondChange>& lawful,
                           std::vector<BondChange>& before, BondUpdate& update) {
  if (ties.empty()) return;
  std::vector<BondChange> changes;
  for (const std::vector<BondChange>& tie : ties) changes.insert(changes.end(), tie.begin(), tie.end());
  std::vector<BondChange> all = changes, had;
  const std::vector<std::int32_t> ends = lower_with_fragments(all, had);
  body.changed(ends);
  const GroupMarks marks = dependent_on(ends, body);
  const double after = body.energy(at, marks);
  take_back(had, body);
  const double now = body.energy(at, marks);
  // Points that are inside out already say nothing.
  if (after <= now || !std::isfinite(now)) {
    body.changed(families_.lower(all));
    before.insert(before.end(), had.begin(), had.end());
    lawful.insert(lawful.end(), changes.begin(), changes.end());
    if (std::isfinite(after) && std::isfinite(now)) update.dissipated += now - after;
    return;
  }
  if (ties.size() > 1) {
    const std::size_t half = (ties.size() + 1) / 2;
    try_to_fail(ties.first(half), at, body, lawful, before, update);
    try_to_fail(ties.subspan(half), at, body, lawful, before, update);
    return;
  }
  for (const BondChange& change : changes) {
    update.held += families_.body().owns(static_cast<std::size_t>(change.bond.point));
    if (gradual_) gradual_->hold(change.bond, families_.integrity(change.bond));
  }
}

/// before: in the order in which they fell; a bond of a fragment that had weakened fell twice.
void Fracture::take_back(std::span<const BondChange> before, const Body& body) {
  body.changed(families_.raise(std::vector<BondChange>(before.rbegin(), before.rend())));
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

void Fracture::lower(std::vector<BondChange> changes, const Configuration& at, FieldView force, bool account, const Body& body, BondUpdate& update) {
  if (!on_any_rank(!changes.empty())) return;
  const bool evaluates = force.data || account;
  std::vector<BondChange> before;
  const std::vector<std::int32_t> ends = lower_with_fragments(changes, before);
  if (force.data && part_.size() == 0) part_ = families_.body().make_field(force.components);
  const FieldView part = force.data ? FieldView(part_) : FieldView{};
  GroupMarks marks;
  double stored = 0;
  if (evaluates) {
    // All of them are known now, and those of fragments fall together with those that made them so: between them points that are about to go may be turned
    // inside out.
    take_back(before, body);
    marks = dependent_on(ends, body);
    if (force.data) fill(0.0, part);
    stored = body.forces(at, marks, 1, part);  // so that what the bonds do not change is gone to the last bit
    families_.lower(changes);
  }
  body.changed(ends);
  update.ends.insert(update.ends.end(), ends.begin(), ends.end());
  update.changed += std::max<std::size_t>(before.size(), 1);
  if (!evaluates) return;
  const double left = body.forces(at, marks, -1, part);
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
                       [&](std::int32_t p) { return families_.body().owns(static_cast<std::size_t>(p)) && !(damage_.copies && damage_.copies->image(p)); });
  std::vector<BondId> bonds = families_.fragment_bonds(own);
  if (damage_.copies) damage_.copies->add_copies(bonds);
  const Field& limit = damage_.last();
  std::erase_if(bonds, [&](BondId b) { return !std::isfinite(limit.data()[b.point] + limit.data()[b.far]); });
  return shared_.of_all(bonds);
}

void Fracture::restore(std::span<const BondChange> changes, const std::function<void(std::span<const std::int32_t>)>& changed) {
  changed(families_.mend());
  const std::vector<std::int32_t> ends = families_.lower(changes);
  changed(ends);
  if (gradual_) gradual_->restore(changes, fragments(ends));
  finder_->forget();
  hastened_.forget();
  weakening_.clear();
  settling_.clear();
}

BondChecks Fracture::checks() const {
  std::int64_t counts[4] = {static_cast<std::int64_t>(updates_ * finder_->groups()),
                            static_cast<std::int64_t>(finder_->checked()), 0, 0};
  for (const BondChange& change : families_.changed())
    if (families_.body().owns(static_cast<std::size_t>(change.bond.point))) ++counts[change.integrity == 0 ? 2 : 3];
  communicator().sum(counts);
  const auto count = [&](std::size_t k) { return static_cast<std::size_t>(counts[k]); };
  return {updates_, count(0), count(1), count(2), count(3)};
}

}  // namespace perikit
