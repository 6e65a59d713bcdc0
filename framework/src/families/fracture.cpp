#include "families/fracture.hpp"

#include <algorithm>
#include <cmath>

namespace perikit {

Fracture::Fracture(Families& families, const BodyDamage& damage, std::unique_ptr<BondFinder> finder)
    : families_(families), damage_(damage), finder_(std::move(finder)) {
  if (damage.gradual()) gradual_.emplace(families.body(), damage.crack_speed);
}

std::vector<double> Fracture::moments(std::span<const BondChange> changes, ConstFieldView before, ConstFieldView u) {
  // Bonds that let go in the course of steps, or weaken, do so all through the step.
  if (gradual_) return std::vector<double>(changes.size(), 0.5);
  std::vector<BondId> bonds;
  for (const BondChange& change : changes) bonds.push_back(change.bond);
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
    moments.push_back(0.5 * (crossing(limits.onset) + crossing(limits.failure)));
  }
  return moments;
}

BondUpdate Fracture::update(ConstFieldView u, double time_step, const StepBegin& begin, BondReaction* reaction,
                            const Body& body) {
  ++updates_;
  std::vector<BondChange> changes = finder_->find(u);
  if (gradual_) changes = gradual_->let_go(changes, time_step);
  if (changes.empty()) return {};
  BondUpdate update;
  if (!begin) {
    fail(std::move(changes), u, u, nullptr, body, update);
    return update;
  }
  const int d = u.components;
  if (before_.size() == 0) {
    before_ = families_.body().make_field(d);
    at_ = families_.body().make_field(d);
  }
  begin(before_);
  reaction->impulse = families_.body().make_field(d);
  reaction->drift = families_.body().make_field(d);
  const std::vector<double> moments = this->moments(changes, before_, u);
  // Those of each half of the step at the mean of their moments.
  for (const bool early : {true, false}) {
    std::vector<BondChange> of_half;
    double sum = 0;
    for (std::size_t k = 0; k < changes.size(); ++k) {
      if ((moments[k] < 0.5) != early || families_.integrity(changes[k].bond) <= changes[k].integrity) continue;
      of_half.push_back(changes[k]);
      sum += moments[k];
    }
    if (of_half.empty()) continue;
    const double moment = sum / static_cast<double>(of_half.size());
    for (std::size_t k = 0; k < u.size(); ++k) at_.data()[k] = before_.data()[k] + moment * (u.data[k] - before_.data()[k]);
    // The bonds act until they fail, at `moment`. A step has the forces of its beginning for the first half, and those of its
    // end, which are to be without these bonds, for the second: what the bonds owe, or gave too much, is an impulse. Of the first
    // half it belongs to the beginning of the step and has moved the points since.
    const double owed = (moment - 0.5) * time_step;
    Field& impulse = reaction->impulse;
    const Owing act = [&](double sign, const GroupMarks& marks) { body.forces(at_, marks, sign * owed, impulse); };
    fail(std::move(of_half), u, at_, act, body, update);
    for (std::size_t k = 0; early && k < u.size(); ++k) reaction->drift.data()[k] = time_step * impulse.data()[k];
  }
  return update;
}

/// Lowers bonds, and those of fragments with them. at: where they fail; owing(sign, marks): adds sign times what the forces of
/// the marked groups there owe.
void Fracture::fail(std::vector<BondChange> changes, ConstFieldView u, ConstFieldView at, const Owing& owing, const Body& body,
                    BondUpdate& update) {
  while (!changes.empty()) {
    std::vector<std::int32_t> ends;
    for (const BondChange& c : changes) {
      ends.push_back(c.bond.point);
      ends.push_back(c.bond.far);
    }
    std::sort(ends.begin(), ends.end());
    ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
    GroupMarks marks(families_.body().stride() / padding, 0);
    families_.mark(ends, marks);
    const double here = body.energy(u, marks), there = owing ? body.energy(at, marks) : here;
    if (owing) owing(1, marks);
    families_.lower(changes);
    body.changed(ends);
    const double left = body.energy(u, marks);
    update.changed += changes.size();
    update.released += here - left;
    update.dissipated += owing ? there - body.energy(at, marks) : here - left;
    if (owing) owing(-1, marks);
    const std::vector<BondId> of_fragments = fragments(ends);
    if (gradual_) {
      gradual_->fade(of_fragments);
      break;
    }
    changes.clear();
    for (const BondId bond : of_fragments) changes.push_back({bond, 0.0});
  }
}

std::vector<BondId> Fracture::fragments(std::span<const std::int32_t> points) const {
  std::vector<BondId> bonds = families_.fragment_bonds(points);
  const Field& limit = damage_.last();
  std::erase_if(bonds, [&](BondId b) { return !std::isfinite(limit.data()[b.point] + limit.data()[b.far]); });
  return bonds;
}

void Fracture::restore(std::span<const BondChange> changes, const std::function<void(std::span<const std::int32_t>)>& changed) {
  changed(families_.mend());
  const std::vector<std::int32_t> ends = families_.lower(changes);
  changed(ends);
  if (gradual_) gradual_->restore(changes, fragments(ends));
  finder_->forget();
}

BondChecks Fracture::checks() const {
  const std::vector<BondChange> present = families_.changed();
  const auto failed = static_cast<std::size_t>(
      std::count_if(present.begin(), present.end(), [](const BondChange& c) { return c.integrity == 0; }));
  return {updates_, updates_ * finder_->groups(), finder_->checked(), failed, present.size() - failed};
}

}  // namespace perikit
