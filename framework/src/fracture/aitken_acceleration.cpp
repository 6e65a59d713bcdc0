#include "fracture/aitken_acceleration.hpp"

#include <algorithm>

namespace perikit {

namespace {

constexpr double most = 0.999;      // ratio: slower ones may be no series that ends
constexpr double cautious = 0.5;    // share of what is still to come

}  // namespace

std::vector<double> AitkenAcceleration::ratios(const std::vector<BondChange>& changes, const std::vector<double>& from) {
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
    if (!(ratio[k] < most)) continue;
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
    if (ratio[k] < most && changes[k].integrity > 0) bonds.push_back(changes[k].bond);
  return bonds;
}

}  // namespace perikit
