#include "fracture/aitken_acceleration.hpp"

#include <algorithm>

namespace perikit {

namespace {

// Ratios that are believed: of series that may be none that ends, those alone that have gone on for long. Near the limit of stability 0.996 was met, which without forecasts would go on for more than 1000 rounds.
constexpr double most = 0.98, most_later = 0.999;
constexpr int patience = 100;       // rounds
constexpr double cautious = 0.5;    // share of what is still to come

}  // namespace

double AitkenAcceleration::most_ratio() const noexcept { return rounds_ > patience ? most_later : most; }

std::vector<double> AitkenAcceleration::ratios(const std::vector<BondChange>& changes, const std::vector<double>& from) {
  ++rounds_;
  std::map<BondId, double> falls;
  std::vector<double> ratios;
  for (std::size_t k = 0; k < changes.size(); ++k) {
    const double fall = from[k] - changes[k].integrity;
    const auto last = last_.find(changes[k].bond);
    ratios.push_back(last == last_.end() ? 1.0 : fall / last->second);
    falls[changes[k].bond] = fall;
  }
  last_ = std::move(falls);
  return ratios;
}

void AitkenAcceleration::accelerate(std::vector<BondChange>& changes, const std::vector<double>& from) {
  const std::vector<double> ratio = ratios(changes, from);
  for (std::size_t k = 0; k < changes.size(); ++k) {
    if (!(ratio[k] < most_ratio())) continue;
    BondChange& change = changes[k];
    const double fall = from[k] - change.integrity;
    change.integrity = std::max(change.integrity - cautious * fall * ratio[k] / (1 - ratio[k]), least_left * change.integrity);
    last_.erase(change.bond);
  }
}

std::vector<BondId> AitkenAcceleration::settling(const std::vector<BondChange>& changes, const std::vector<double>& from) {
  const std::vector<double> ratio = ratios(changes, from);
  std::vector<BondId> bonds;
  for (std::size_t k = 0; k < changes.size(); ++k)
    if (ratio[k] < most_ratio() && changes[k].integrity > 0) bonds.push_back(changes[k].bond);
  return bonds;
}

}  // namespace perikit
