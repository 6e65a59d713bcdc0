#include "families/fracture.hpp"

#include <algorithm>
#include <cmath>

namespace perikit {

Fracture::Fracture(Families& families, const BodyDamage& damage, bool skip, const NearestFailure* known)
    : families_(families), damage_(damage) {
  families.let_fail();
  monitor_ = families.make_monitor(damage, skip, known);
  if (damage.gradual()) gradual_.emplace(families.body(), damage.crack_speed);
}

BondUpdate Fracture::update(ConstFieldView u, double time_step, const Motion& motion, const Energy& energy, const Changed& changed) {
  ++updates_;
  std::vector<BondChange> changes = monitor_->find(u);
  if (gradual_) changes = gradual_->let_go(changes, time_step);
  if (changes.empty()) return {};
  if (motion) {
    if (end_.size() == 0) end_ = families_.body().make_field(u.components);
    motion(end_);
  }
  BondUpdate update;
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
    const double here = energy(u, marks), there = motion ? energy(end_, marks) : here;
    families_.lower(changes);
    changed(ends);
    const double left = energy(u, marks);
    update.changed += changes.size();
    update.released += here - left;
    update.dissipated += motion ? there - energy(end_, marks) : here - left;
    const std::vector<BondId> of_fragments = fragments(ends);
    if (gradual_) {
      gradual_->fade(of_fragments);
      break;
    }
    changes.clear();
    for (const BondId bond : of_fragments) changes.push_back({bond, 0.0});
  }
  return update;
}

std::vector<BondId> Fracture::fragments(std::span<const std::int32_t> points) const {
  std::vector<BondId> bonds = families_.fragment_bonds(points);
  const Field& limit = damage_.last();
  std::erase_if(bonds, [&](BondId b) { return !std::isfinite(limit.data()[b.point] + limit.data()[b.far]); });
  return bonds;
}

void Fracture::restore(std::span<const BondChange> changes, const Changed& changed) {
  changed(families_.mend());
  const std::vector<std::int32_t> ends = families_.lower(changes);
  changed(ends);
  if (gradual_) gradual_->restore(changes, fragments(ends));
  monitor_->forget();
}

BondChecks Fracture::checks() const {
  const std::vector<BondChange> present = families_.changed();
  const auto failed = static_cast<std::size_t>(std::count_if(present.begin(), present.end(), [](const BondChange& c) { return c.integrity == 0; }));
  return {updates_, updates_ * monitor_->groups(), monitor_->checked(), failed, present.size() - failed};
}

}  // namespace perikit
