#include "families/gradual_failure.hpp"

#include <cmath>

namespace perikit {

std::vector<BondChange> GradualFailure::let_go(std::vector<BondChange> found) {
  for (BondChange& c : found) {
    c.integrity = 1;
    if (!fading_.contains(c.bond)) letting_go_.try_emplace(c.bond, c);
  }
  std::vector<BondChange> changes;
  const auto advance = [&](std::map<std::int64_t, BondChange>& bonds, const auto& next) {
    for (auto entry = bonds.begin(); entry != bonds.end();) {
      BondChange& c = entry->second;
      c.integrity = next(c);
      changes.push_back(c);
      entry = c.integrity > 0 ? std::next(entry) : bonds.erase(entry);
    }
  };
  advance(letting_go_, [&](const BondChange& c) {
    const Point x = body_->position(static_cast<std::size_t>(c.point)), y = body_->position(static_cast<std::size_t>(c.far));
    const double left = c.integrity - time_step_ * speed(c) / std::hypot(y[0] - x[0], y[1] - x[1], y[2] - x[2]);
    return left < 1e-9 ? 0.0 : left;
  });
  // exp(-3), 5 %, is left after the time that a crack needs across the family, and dropped.
  advance(fading_, [&](const BondChange& c) {
    const double left = c.integrity * std::exp(-3 * time_step_ * speed(c) / body_->horizon());
    return left < 0.05 ? 0.0 : left;
  });
  return changes;
}

void GradualFailure::fade(std::span<const BondChange> bonds) {
  for (const BondChange& c : bonds) {
    const auto begun = letting_go_.find(c.bond);
    const double left = begun == letting_go_.end() ? 1.0 : begun->second.integrity;
    if (begun != letting_go_.end()) letting_go_.erase(begun);
    fading_.try_emplace(c.bond, BondChange{c.point, c.far, c.bond, left});
  }
}

void GradualFailure::restore(std::span<const BondChange> log, std::span<const BondChange> of_fragments) {
  letting_go_.clear();
  fading_.clear();
  for (const BondChange& c : log)
    if (c.integrity > 0) letting_go_.emplace(c.bond, c);
  fade(of_fragments);
}

}  // namespace perikit
