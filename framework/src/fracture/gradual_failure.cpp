#include "fracture/gradual_failure.hpp"

#include <cmath>

namespace perikit {

std::vector<BondChange> GradualFailure::let_go(std::span<const BondChange> found, double time_step) {
  for (const BondChange& change : found)
    if (!fading_.contains(change.bond)) letting_go_.try_emplace(change.bond, 1.0);
  std::vector<BondChange> changes;
  const auto advance = [&](std::map<BondId, double>& bonds, const auto& next) {
    for (auto entry = bonds.begin(); entry != bonds.end();) {
      entry->second = next(entry->first, entry->second);
      changes.push_back({entry->first, entry->second});
      entry = entry->second > 0 ? std::next(entry) : bonds.erase(entry);
    }
  };
  advance(letting_go_, [&](BondId bond, double integrity) {
    const Point x = body_.position(static_cast<std::size_t>(bond.point)), y = body_.position(static_cast<std::size_t>(bond.far));
    const double left = integrity - time_step * speed(bond) / std::hypot(y[0] - x[0], y[1] - x[1], y[2] - x[2]);
    return left < 1e-9 ? 0.0 : left;
  });
  // exp(-3), 5 %, is left after the time that a crack needs across the family, and dropped.
  advance(fading_, [&](BondId bond, double integrity) {
    const double left = integrity * std::exp(-3 * time_step * speed(bond) / body_.horizon());
    return left < 0.05 ? 0.0 : left;
  });
  return changes;
}

void GradualFailure::fade(std::span<const BondId> bonds) {
  for (const BondId bond : bonds) {
    const auto begun = letting_go_.find(bond);
    const double left = begun == letting_go_.end() ? 1.0 : begun->second;
    if (begun != letting_go_.end()) letting_go_.erase(begun);
    fading_.try_emplace(bond, left);
  }
}

void GradualFailure::hold(BondId bond, double integrity) {
  // One that would have gone altogether is in neither of them.
  if (const auto fading = fading_.find(bond); fading != fading_.end())
    fading->second = integrity;
  else if (integrity < 1)
    letting_go_[bond] = integrity;
  else
    letting_go_.erase(bond);
}

void GradualFailure::restore(std::span<const BondChange> changes, std::span<const BondId> of_fragments) {
  letting_go_.clear();
  fading_.clear();
  for (const BondChange& change : changes)
    if (change.integrity > 0) letting_go_.emplace(change.bond, change.integrity);
  fade(of_fragments);
}

}  // namespace perikit
