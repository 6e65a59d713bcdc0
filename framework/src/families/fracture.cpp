#include "families/fracture.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "perikit/core/communicator.hpp"

namespace perikit {

namespace {

bool on_any_rank(bool here) {
  return communicator().largest(here ? 1 : 0) > 0;
}

}  // namespace

Fracture::Fracture(Families& families, const BodyDamage& damage, bool skip, const NearestFailure* known)
    : families_(families), damage_(damage), shared_(families.body()) {
  families.let_fail();
  monitor_ = families.make_monitor(damage, skip, known);
  if (damage.gradual()) gradual_.emplace(families.body(), damage.crack_speed);
}

BondUpdate Fracture::update(ConstFieldView u, double time_step, const Motion& motion, const Energy& energy,
                            const Changed& changed) {
  ++updates_;
  std::vector<BondChange> changes = monitor_->find(u);
  if (gradual_) changes = gradual_->let_go(changes, time_step);
  if (!on_any_rank(!changes.empty())) return {};
  if (motion) {
    if (end_.size() == 0) end_ = families_.body().make_field(u.components);
    motion(end_);
  }
  BondUpdate update;
  while (on_any_rank(!changes.empty())) {
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
    update.changed += std::max<std::size_t>(changes.size(), 1);
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
  // Others know the whole families of their own points alone.
  std::vector<std::int32_t> own;
  std::ranges::copy_if(points, std::back_inserter(own),
                       [&](std::int32_t p) { return families_.body().owns(static_cast<std::size_t>(p)); });
  std::vector<BondId> bonds = families_.fragment_bonds(own);
  const Field& limit = damage_.last();
  std::erase_if(bonds, [&](BondId b) { return !std::isfinite(limit.data()[b.point] + limit.data()[b.far]); });
  return shared_.of_all(bonds);
}

std::vector<BondChange> Fracture::changed() const {
  return shared_.outward(families_.changed());
}

void Fracture::restore(std::span<const BondChange> of_all, const Changed& changed) {
  const std::vector<BondChange> changes = shared_.inward(of_all);
  changed(families_.mend());
  const std::vector<std::int32_t> ends = families_.lower(changes);
  changed(ends);
  if (gradual_) gradual_->restore(changes, fragments(ends));
  monitor_->forget();
}

BondChecks Fracture::checks() const {
  std::int64_t counts[4] = {static_cast<std::int64_t>(updates_ * monitor_->groups()),
                            static_cast<std::int64_t>(monitor_->checked()), 0, 0};
  for (const BondChange& change : families_.changed())
    if (families_.body().owns(static_cast<std::size_t>(change.bond.point))) ++counts[change.integrity == 0 ? 2 : 3];
  communicator().sum(counts);
  const auto count = [&](std::size_t k) { return static_cast<std::size_t>(counts[k]); };
  return {updates_, count(0), count(1), count(2), count(3)};
}

}  // namespace perikit
