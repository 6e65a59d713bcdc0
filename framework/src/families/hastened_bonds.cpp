#include "families/hastened_bonds.hpp"

#include <algorithm>

namespace perikit {

namespace {

constexpr double most = 0.98;       // ratio: slower ones may be no series that ends
constexpr double cautious = 0.5;    // share of what is still to come
constexpr double least_left = 0.5;  // of the integrity: no bond fails by a forecast

}  // namespace

void HastenedBonds::hasten(std::vector<BondChange>& changes, const std::vector<double>& from) {
  std::map<BondId, double> falls;
  for (std::size_t k = 0; k < changes.size(); ++k) {
    BondChange& change = changes[k];
    const double fall = from[k] - change.integrity;
    const auto last = last_.find(change.bond);
    const double ratio = last == last_.end() ? 1.0 : fall / last->second;
    if (ratio < most)
      change.integrity = std::max(change.integrity - cautious * fall * ratio / (1 - ratio), least_left * change.integrity);
    else
      falls[change.bond] = fall;
  }
  last_ = std::move(falls);
}

}  // namespace perikit
