#include "families/fracture.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "perikit/core/communicator.hpp"
#include "perikit/core/field_operations.hpp"

namespace perikit {

namespace {

bool on_any_rank(bool here) {
  return communicator().largest(here ? 1 : 0) > 0;
}

constexpr double not_now = -1;

/// A bond that stayed for the second law would be tried in vain in most steps: it is where its value comes past another rung of a
/// ladder with eight of them for a factor of two.
bool past_a_rung(double from, double to, double limit) {
  const auto rung = [&](double value) { return std::floor(8 * std::log2(value / limit)); };
  return rung(from) != rung(to);
}

}  // namespace

Fracture::Fracture(Families& families, const BodyDamage& damage, std::unique_ptr<BondFinder> finder)
    : families_(families), damage_(damage), shared_(families.body()), finder_(std::move(finder)) {
  if (damage.gradual()) gradual_.emplace(families.body(), damage.crack_speed);
}

std::vector<double> Fracture::moments(std::span<const BondChange> changes, ConstFieldView before, ConstFieldView u) {
  // Bonds that let go in the course of steps, or weaken, do so all through the step.
  if (gradual_) return std::vector<double>(changes.size(), 0.5);
  // Energies and stresses are right at the points of this rank: each rank knows the moments of bonds that begin there.
  const bool share = shared_.part() && !damage_.by_stretch();
  std::vector<BondId> bonds;
  for (const BondChange& change : changes)
    if (!share || families_.body().owns(static_cast<std::size_t>(change.bond.point))) bonds.push_back(change.bond);
  std::vector<double> start(bonds.size()), end(bonds.size()), moments;
  finder_->values(bonds, before, start);
  finder_->values(bonds, u, end);
  // Energies grow with the square of what the bonds do.
  const bool square = damage_.law->traits().energy;
  const auto linear = [&](double value) { return square ? std::copysign(std::sqrt(std::abs(value)), value) : value; };
  for (std::size_t k = 0; k < bonds.size(); ++k) {
    const double first = linear(start[k]), last = linear(end[k]);
    const auto crossing = [&](double limit) {
      return first < last ? std::clamp((linear(limit) - first) / (last - first), 0.0, 1.0) : 0.0;
    };
    const DamageLimits limits = damage_.limits(static_cast<std::size_t>(bonds[k].point), static_cast<std::size_t>(bonds[k].far));
    if (damage_.second_law && start[k] > limits.failure && !past_a_rung(start[k], end[k], limits.failure))
      moments.push_back(not_now);
    else
      moments.push_back(0.5 * (crossing(limits.onset) + crossing(limits.failure)));
  }
  if (!share) return moments;
  std::vector<BondChange> mine;
  for (std::size_t k = 0; k < bonds.size(); ++k) mine.push_back({bonds[k], moments[k]});
  moments.clear();
  for (const BondChange& moment : shared_.of_all(mine)) moments.push_back(moment.integrity);
  return moments;
}

BondUpdate Fracture::update(ConstFieldView u, double time_step, const StepBegin& begin, BondReaction* reaction,
                            const Body& body) {
  ++updates_;
  weakening_.clear();
  settling_.clear();
  std::vector<BondChange> changes = finder_->find(u);
  // Ranks see what bonds of their own points hold, but all must know which bonds fail.
  if (shared_.part() && !damage_.by_stretch() && on_any_rank(!changes.empty())) changes = shared_.of_all(changes);
  if (gradual_) changes = gradual_->let_go(changes, time_step);
  if (!on_any_rank(!changes.empty())) return {};
  BondUpdate update;
  if (!begin) {
    if (time_step > 0) hastened_.forget();
    if (!damage_.law->traits().bits) {
      std::vector<double> from;
      for (const BondChange& change : changes) from.push_back(families_.integrity(change.bond));
      if (forecasts_) {
        hastened_.hasten(changes, from);
      } else {
        settling_ = hastened_.settling(changes, from);
        for (const BondChange& change : changes)
          if (change.integrity > 0) weakening_.push_back(change.bond);
      }
    }
    fail(std::move(changes), u, 0, {}, body, update);
    finish(update);
    return update;
  }
  const int d = u.components;
  if (before_.size() == 0) {
    before_ = families_.body().make_field(d);
    at_ = families_.body().make_field(d);
  }
  begin(before_);
  for (Field* field : {&reaction->impulse, &reaction->drift}) {
    if (field->size() == 0) *field = families_.body().make_field(d);
    else fill(0.0, *field);
  }
  const std::vector<double> moments = this->moments(changes, before_, u);
  for (std::size_t k = 0; k < changes.size(); ++k)
    update.held += moments[k] == not_now && families_.body().owns(static_cast<std::size_t>(changes[k].bond.point));
  // Those of each half of the step at the mean of their moments.
  for (const bool early : {true, false}) {
    std::vector<BondChange> of_half;
    ExactSum sum;
    std::int64_t count = 0;  // each bond once, where its first point is
    for (std::size_t k = 0; k < changes.size(); ++k) {
      if (moments[k] == not_now || (moments[k] < 0.5) != early || families_.integrity(changes[k].bond) <= changes[k].integrity)
        continue;
      of_half.push_back(changes[k]);
      if (!families_.body().owns(static_cast<std::size_t>(changes[k].bond.point))) continue;
      sum.add(moments[k]);
      ++count;
    }
    communicator().sum({&count, 1});
    if (count == 0) continue;
    const double moment = total_over_ranks(sum) / static_cast<double>(count);
    for (std::size_t k = 0; k < u.size(); ++k) at_.data()[k] = before_.data()[k] + moment * (u.data[k] - before_.data()[k]);
    // The bonds act until they fail, at `moment`. A step has the forces of its beginning for the first half, and those of its
    // end, which are to be without these bonds, for the second: what the bonds owe, or gave too much, is an impulse. Of the first
    // half it belongs to the beginning of the step and has moved the points since.
    const double owed = (moment - 0.5) * time_step;
    Field& impulse = reaction->impulse;
    fail(std::move(of_half), at_, owed, impulse, body, update);
    for (std::size_t k = 0; early && k < u.size(); ++k) reaction->drift.data()[k] = time_step * impulse.data()[k];
  }
  finish(update);
  return update;
}

std::vector<double> Fracture::integrities(std::span<const BondId> bonds, ConstFieldView u) {
  const std::size_t size = padded(bonds.size());
  AlignedVector<double> value(size, 0.0), onset(size, 1.0), failure(size, 1.0), left(size, 1.0);
  finder_->values(bonds, u, {value.data(), bonds.size()});
  for (std::size_t k = 0; k < bonds.size(); ++k) {
    const DamageLimits limits = damage_.limits(static_cast<std::size_t>(bonds[k].point), static_cast<std::size_t>(bonds[k].far));
    onset[k] = limits.onset;
    failure[k] = limits.failure;
  }
  damage_.law->integrity({static_cast<int>(bonds.size()), value.data(), onset.data(), failure.data(), left.data()});
  return {left.begin(), left.begin() + static_cast<std::ptrdiff_t>(bonds.size())};
}

bool Fracture::add_weakening(ConstFieldView u, ConstFieldView w, FieldView force, const Body& body) {
  const double length = largest_magnitude(w);
  if (weakening_.empty() || length == 0) return true;
  // Central differences: points move by the cube root of the rounding unit times the spacing.
  const double step = std::cbrt(std::numeric_limits<double>::epsilon()) * families_.body().spacing() / length;
  Field at = families_.body().make_field(u.components);
  combine(1, u, step, w, at);
  std::vector<double> slope = integrities(weakening_, at);
  combine(1, u, -step, w, at);
  const std::vector<double> behind = integrities(weakening_, at);
  double largest = 0;
  for (std::size_t k = 0; k < slope.size(); ++k) {
    slope[k] = (slope[k] - behind[k]) / (2 * step);
    largest = std::max(largest, std::abs(slope[k]));
  }
  if (largest == 0) return true;
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
  const bool known = std::isfinite(body.forces(u, marks, -1 / change, force));
  body.changed(families_.lower(after));
  const bool still = std::isfinite(body.forces(u, marks, 1 / change, force));
  body.changed(families_.raise(before));
  return known && still;
}

BondUpdate Fracture::weaken(ConstFieldView u, ConstFieldView forecast, const Body& body) {
  const std::vector<double> ahead = integrities(settling_, forecast);
  std::vector<BondChange> changes;
  for (std::size_t k = 0; k < settling_.size(); ++k) {
    const double now = families_.integrity(settling_[k]), then = std::max(ahead[k], HastenedBonds::least_left * now);
    if (then < now) changes.push_back({settling_[k], then});
  }
  BondUpdate update;
  if (changes.empty()) return update;
  fail(std::move(changes), u, 0, {}, body, update);
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
  GroupMarks marks = families_.groups_of(ends);
  if (!body.owners_alone) families_.mark(ends, marks);
  shared_.mark(marks);
  return marks;
}

/// Those and more of them where families of these points have lost much: bonds of fragments may follow.
GroupMarks Fracture::widened(GroupMarks marks, std::span<const std::int32_t> ends) const {
  constexpr double much = 0.5;
  const auto poor = [&](std::int32_t p) {
    const auto point = static_cast<std::size_t>(p);
    return families_.body().owns(point) && families_.damage(point) > much;
  };
  if (!on_any_rank(std::ranges::any_of(ends, poor))) return marks;
  for (int ring = 0; ring < 2; ++ring) {
    marks = families_.around(marks);
    shared_.mark(marks);
  }
  return marks;
}

void Fracture::fail(std::vector<BondChange> changes, ConstFieldView at, double owed, FieldView impulse, const Body& body,
                    BondUpdate& update) {
  if (damage_.second_law) {
    std::vector<BondChange> lawful, before;
    try_to_fail(std::move(changes), at, body, lawful, before, update);
    // Once more, with forces, and together.
    take_back(before, body);
    changes = std::move(lawful);
  }
  lower(std::move(changes), at, owed, impulse, body, update);
}

/// Lowers bonds, and those of fragments, where the energy at `at` does not rise, and halves of them where it does. lawful: those
/// that were; before: their integrities, and those of the fragments' bonds, in the order in which they fell. All ranks must call
/// it.
void Fracture::try_to_fail(std::vector<BondChange> changes, ConstFieldView at, const Body& body, std::vector<BondChange>& lawful,
                           std::vector<BondChange>& before, BondUpdate& update) {
  if (!on_any_rank(!changes.empty())) return;
  const std::size_t known = before.size();
  std::vector<std::int32_t> all;
  const auto lower_all = [&] {
    for (std::vector<BondChange> falling = changes; on_any_rank(!falling.empty());) {
      for (const BondChange& change : falling) before.push_back({change.bond, families_.integrity(change.bond)});
      const std::vector<std::int32_t> ends = families_.lower(falling);
      body.changed(ends);
      all.insert(all.end(), ends.begin(), ends.end());
      falling.clear();
      for (const BondId bond : gradual_ ? std::vector<BondId>() : fragments(ends)) falling.push_back({bond, 0.0});
    }
  };
  lower_all();
  const GroupMarks marks = dependent_on(all, body);
  const double after = body.energy(at, marks);
  std::vector<BondChange> tried(before.begin() + static_cast<std::ptrdiff_t>(known), before.end());
  before.resize(known);
  take_back(tried, body);
  // Points that are inside out already say nothing.
  if (const double now = body.energy(at, marks); after <= now || !std::isfinite(now)) {
    lower_all();
    lawful.insert(lawful.end(), changes.begin(), changes.end());
    return;
  }
  std::vector<BondChange> rest = later_half(changes);
  if (on_any_rank(!rest.empty())) {
    try_to_fail(std::move(changes), at, body, lawful, before, update);
    try_to_fail(std::move(rest), at, body, lawful, before, update);
    return;
  }
  for (const BondChange& change : changes) {
    update.held += families_.body().owns(static_cast<std::size_t>(change.bond.point));
    if (gradual_) gradual_->hold(change.bond, families_.integrity(change.bond));
  }
}

/// before: in the order in which they fell; a bond of a fragment that had weakened fell twice.
void Fracture::take_back(std::vector<BondChange>& before, const Body& body) {
  std::ranges::reverse(before);
  body.changed(families_.raise(before));
}

/// Takes the later half of what all ranks have, by names in the whole body, out of `changes`; nothing of a single bond. All ranks
/// must call it.
std::vector<BondChange> Fracture::later_half(std::vector<BondChange>& changes) const {
  double first = std::numeric_limits<double>::infinity(), last = -first;
  for (const BondChange& change : changes) {
    first = std::min(first, shared_.name(change.bond));
    last = std::max(last, shared_.name(change.bond));
  }
  first = -communicator().largest(-first);
  last = communicator().largest(last);
  const double middle = std::floor(0.5 * (first + last));
  const auto rest =
      std::ranges::stable_partition(changes, [&](const BondChange& change) { return shared_.name(change.bond) <= middle; });
  std::vector<BondChange> later(rest.begin(), rest.end());
  changes.erase(rest.begin(), rest.end());
  return later;
}

/// Between the first bonds and the last ones of fragments nothing is evaluated where that can be helped: points that are about to
/// go may be turned inside out.
void Fracture::lower(std::vector<BondChange> changes, ConstFieldView at, double owed, FieldView impulse, const Body& body,
                     BondUpdate& update) {
  if (impulse.data && part_.size() == 0) part_ = families_.body().make_field(impulse.components);
  const FieldView part = impulse.data ? FieldView(part_) : FieldView{};
  GroupMarks marks;   // empty: no forces are waiting for those without the bonds
  double before = 0;
  const auto settle = [&] {
    if (marks.empty()) return;
    const double after = body.forces(at, marks, -1, part);
    marks.clear();
    if (!std::isfinite(before) || !std::isfinite(after)) {
      ++update.inside_out;
      return;
    }
    update.dissipated += before - after;
    if (impulse.data) combine(1, impulse, owed, part, impulse);
  };
  while (on_any_rank(!changes.empty())) {
    std::vector<std::int32_t> ends;
    for (const BondChange& c : changes) {
      ends.push_back(c.bond.point);
      ends.push_back(c.bond.far);
    }
    std::sort(ends.begin(), ends.end());
    ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
    GroupMarks of_these = dependent_on(ends, body);
    const auto marked = [](std::uint8_t wanted, std::uint8_t have) { return !wanted || have; };
    if (on_any_rank(marks.empty() || !std::equal(of_these.begin(), of_these.end(), marks.begin(), marked))) {
      settle();
      marks = widened(std::move(of_these), ends);
      if (impulse.data) fill(0.0, part);
      before = body.forces(at, marks, 1, part);  // so that what the bonds do not change is gone to the last bit
    }
    families_.lower(changes);
    body.changed(ends);
    update.ends.insert(update.ends.end(), ends.begin(), ends.end());
    update.changed += std::max<std::size_t>(changes.size(), 1);
    changes.clear();
    if (gradual_) break;  // bonds of fragments fade
    for (const BondId bond : fragments(ends)) changes.push_back({bond, 0.0});
  }
  settle();
}

std::vector<BondId> Fracture::fragments(std::span<const std::int32_t> points) const {
  // Others know the whole families of their own points alone.
  std::vector<std::int32_t> own;
  std::ranges::copy_if(points, std::back_inserter(own),
                       [&](std::int32_t p) { return families_.body().owns(static_cast<std::size_t>(p)); });
  std::vector<BondId> bonds = families_.fragment_bonds(own);
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
