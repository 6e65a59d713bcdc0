#include "families/bond_state.hpp"

#include <algorithm>
#include <cmath>

#include "families/gradual_failure.hpp"

namespace perikit {

namespace {

bool before(const BondChange& a, const BondChange& b) noexcept { return a.point != b.point ? a.point < b.point : a.bond < b.bond; }

}  // namespace

BondUpdate Fracture::update(ConstFieldView u, const Motion& motion, const Energy& energy, const Changed& changed) {
  ++updates_;
  GradualFailure* const gradual = gradual_failure(damage_.law);
  std::vector<BondChange> changes = monitor_->find(u);
  if (gradual) changes = gradual->let_go(std::move(changes));
  if (changes.empty()) return {};
  if (motion) {
    if (end_.size() == 0) end_ = body_.make_field(u.components);
    motion(end_);
  }
  ++version_;
  BondUpdate update;
  while (!changes.empty()) {
    std::vector<std::int32_t> ends;
    for (const BondChange& c : changes) {
      ends.push_back(c.point);
      ends.push_back(c.far);
    }
    std::sort(ends.begin(), ends.end());
    ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
    GroupMarks marks(body_.stride() / padding, 0);
    state_.mark_families(ends, marks);
    const double here = energy(u, marks), there = motion ? energy(end_, marks) : here;
    std::vector<BondChange> next = allowed(changed(state_.lower(changes)));
    remember(changes);
    const double left = energy(u, marks);
    update.changed += changes.size();
    update.released += here - left;
    update.dissipated += motion ? there - energy(end_, marks) : here - left;
    if (gradual) {
      gradual->fade(next);
      break;
    }
    changes = std::move(next);
  }
  return update;
}

std::vector<BondChange> Fracture::allowed(std::vector<BondChange> changes) const {
  const auto& limit = damage_.last();
  std::erase_if(changes, [&](const BondChange& c) { return !std::isfinite(limit.data()[c.point] + limit.data()[c.far]); });
  std::sort(changes.begin(), changes.end(), before);
  changes.erase(std::unique(changes.begin(), changes.end(), [](const BondChange& a, const BondChange& b) { return a.point == b.point && a.bond == b.bond; }),
                changes.end());
  return changes;
}

std::vector<BondChange> Fracture::changes() const {
  std::vector<BondChange> sorted = log_;
  std::stable_sort(sorted.begin(), sorted.end(), before);
  // Of several entries of one bond the last one holds.
  std::vector<BondChange> present;
  for (const BondChange& c : sorted) {
    if (!present.empty() && !before(present.back(), c)) present.pop_back();
    present.push_back(c);
  }
  return present;
}

void Fracture::remember(std::span<const BondChange> changes) {
  log_.insert(log_.end(), changes.begin(), changes.end());
  if (log_.size() < 2 * compact_ + 1024) return;
  log_ = this->changes();
  compact_ = log_.size();
}

void Fracture::restore(std::span<const BondChange> log, const Changed& changed) {
  ++version_;
  changed(state_.mend());
  log_.assign(log.begin(), log.end());
  const std::vector<BondChange> of_fragments = changed(state_.lower(log_));
  if (GradualFailure* const gradual = gradual_failure(damage_.law)) gradual->restore(log_, allowed(of_fragments));
  monitor_->forget();
}

BondChecks Fracture::checks() const {
  const std::vector<BondChange> present = changes();
  const auto failed = static_cast<std::size_t>(std::count_if(present.begin(), present.end(), [](const BondChange& c) { return c.integrity == 0; }));
  return {updates_, updates_ * monitor_->groups(), monitor_->checked(), failed, present.size() - failed};
}

}  // namespace perikit
