#include "families/lattice/lattice_slots.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <numeric>

#include "body/family_limit.hpp"

namespace perikit {

LatticeSlots::LatticeSlots(const Lattice& lattice, double horizon, const InfluenceFunction* influence) : offsets(family_offsets(lattice, horizon)) {
  half = offsets.size() / 2;
  std::vector<double> r;
  for (const auto& d : offsets) {
    shifts.push_back(lattice.shift(d));
    const double length = std::sqrt(double(d[0]) * d[0] + double(d[1]) * d[1] + double(d[2]) * d[2]) * lattice.spacing;
    r.push_back(relative_length(length, horizon));
    auto& bond = xi.emplace_back();
    bond.fill(0.0);
    for (std::size_t k = 0; k < 3; ++k) bond[static_cast<std::size_t>(lattice.axis[k])] = d[k] * lattice.spacing;
  }
  omega.assign(r.size(), 1.0);
  if (influence) influence->evaluate(r, omega);
  ascending.resize(shifts.size());
  std::iota(ascending.begin(), ascending.end(), std::uint16_t{0});
  std::sort(ascending.begin(), ascending.end(), [&](std::uint16_t a, std::uint16_t b) { return shifts[a] < shifts[b]; });
  collect_rows(lattice);
}

std::size_t LatticeSlots::with_shift(std::int64_t shift) const noexcept {
  return *std::lower_bound(ascending.begin(), ascending.end(), shift, [&](std::uint16_t slot, std::int64_t s) { return shifts[slot] < s; });
}

void LatticeSlots::collect_rows(const Lattice& lattice) {
  std::map<std::pair<int, int>, std::map<int, double>> by_row;
  for (std::size_t s = 0; s < offsets.size(); ++s) by_row[{offsets[s][2], offsets[s][1]}][std::abs(offsets[s][0])] = omega[s];
  std::map<int, int> profile_of;
  for (const auto& [row, weights] : by_row) {
    const int d2 = row.first, d1 = row.second, key = d1 * d1 + d2 * d2;
    RowProfile profile;
    profile.reach = weights.rbegin()->first;
    profile.omega.assign(static_cast<std::size_t>(profile.reach) + 1, 0.0);
    profile.omega_d0 = profile.omega;
    for (const auto& [d0, w] : weights) {
      profile.omega[static_cast<std::size_t>(d0)] = w;
      profile.omega_d0[static_cast<std::size_t>(d0)] = w * d0;
    }
    row_reach = std::max(row_reach, profile.reach);
    const auto [entry, fresh] = profile_of.try_emplace(key, static_cast<int>(profiles.size()));
    if (fresh) profiles.push_back(profile);
    if (key == 0) own_row = entry->second;
    if (d2 > 0 || (d2 == 0 && d1 > 0)) row_pairs.push_back({lattice.shift({0, d1, d2}), d1, d2, profile.reach, entry->second});
  }
  std::stable_sort(row_pairs.begin(), row_pairs.end(), [](const RowPair& a, const RowPair& b) { return a.profile < b.profile; });
}

}  // namespace perikit
