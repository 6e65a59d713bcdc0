#include "fracture/search/bond_monitor.hpp"

#include <algorithm>
#include <cmath>

#include "families/bond_stretch.hpp"

namespace perikit {

void BondMonitor::values(std::span<const BondId> bonds, const Configuration& at, std::span<double> values) {
  const ConstFieldView u = at.u();
  for (std::size_t k = 0; k < bonds.size(); ++k) values[k] = bond_stretch(body_, u, bonds[k]);
}

void BondMonitor::set_cells(std::vector<Group> groups, std::vector<std::size_t> cell_first) {
  groups_ = std::move(groups);
  cell_first_ = std::move(cell_first);
  margin_.assign(groups_.size(), 0.0);
  offset_.assign(groups_.size(), 0.0);
  moved_.assign(cells(), 0.0);
  found_.resize(cells());
  checks_.assign(cells(), 0);
}

std::vector<BondChange> BondMonitor::find(const Configuration& at) {
  const ConstFieldView u = at.u();
  const bool known = begin(u) && skip_, all_groups = !skip_ || (renew_ && !known);
  if (all_groups) {
    std::copy_n(u.data, u.size(), reference_.data());
    std::fill(moved_.begin(), moved_.end(), 0.0);
  } else if (!known) {
    bound_motion(u, moved_);
  }
  over_cells([&](std::size_t c) {
    checks_[c] = 0;
    for (std::size_t g = cell_first_[c]; g < cell_first_[c + 1]; ++g) {
      // Margins are used up a little early: rounding must never hide a bond. What is not a number is checked.
      if (known ? !near_failure(groups_[g]) : !all_groups && (moved_[c] + offset_[g]) * (1 + 1e-9) < margin_[g]) continue;
      const double margin = check(groups_[g], u, found_[c]);
      ++checks_[c];
      if (known) continue;  // margins of earlier checks hold on
      margin_[g] = margin;
      offset_[g] = moved_[c];
    }
  });
  std::size_t checks = 0;
  std::vector<BondChange> all;
  for (std::size_t c = 0; c < cells(); ++c) {
    checks += checks_[c];
    all.insert(all.end(), found_[c].begin(), found_[c].end());
    found_[c].clear();
  }
  checked_ += checks;
  if (known) return all;
  since_ = all_groups ? 0 : since_ + checks;
  renew_ = since_ >= groups_.size();
  return all;
}

std::size_t BondMonitor::bytes() const noexcept {
  return reference_.bytes() + groups_.size() * (sizeof(Group) + 2 * sizeof(double)) +
         cells() * (3 * sizeof(std::size_t) + sizeof(found_[0]));
}

}  // namespace perikit
