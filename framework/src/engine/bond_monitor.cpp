#include "bond_monitor.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "perikit/core/parallel.hpp"
#include "perikit/core/simd.hpp"

namespace perikit {

namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();
/// Margins are used up a little early: rounding must never hide a bond.
constexpr double caution = 1 + 1e-9;

}  // namespace

void BondMonitor::set_cells(std::vector<Group> groups, std::vector<std::size_t> cell_first, std::vector<std::vector<std::int32_t>> partners) {
  groups_ = std::move(groups);
  cell_first_ = std::move(cell_first);
  partners_ = std::move(partners);
  const std::size_t cells = partners_.size();
  margin_.assign(groups_.size(), 0.0);
  low_.assign(3 * cells, 0.0);
  high_.assign(3 * cells, 0.0);
  found_.resize(cells);
  checks_.assign(cells, 0);
}

void BondMonitor::forget() { std::fill(margin_.begin(), margin_.end(), 0.0); }

void BondMonitor::bound_motion(std::size_t cell, ConstFieldView u) {
  for (int c = 0; c < u.components; ++c) {
    Pack low(infinite), high(-infinite);
    for (std::size_t g = cell_first_[cell]; g < cell_first_[cell + 1]; ++g) {
      const std::size_t first = static_cast<std::size_t>(groups_[g].first);
      for (std::size_t l = 0; l < padding; l += pack_width) {
        const Pack now = Pack::load(u.component(c) + first + l), step = now - Pack::load(previous_.component(c) + first + l);
        now.store(previous_.component(c) + first + l);
        Pack below = step, above = step;
        if (groups_[g].live != 0xff) {
          for (int k = 0; k < pack_width; ++k) {
            if (groups_[g].live >> (l + static_cast<std::size_t>(k)) & 1) continue;
            below.v[k] = infinite;
            above.v[k] = -infinite;
          }
        }
        low = select(below < low, below, low);
        high = select(above > high, above, high);
      }
    }
    double least = infinite, most = -infinite;
    for (int k = 0; k < pack_width; ++k) {
      least = std::min(least, low[k]);
      most = std::max(most, high[k]);
    }
    low_[3 * cell + static_cast<std::size_t>(c)] = least;
    high_[3 * cell + static_cast<std::size_t>(c)] = most;
  }
}

double BondMonitor::relative_motion(std::size_t cell) const noexcept {
  double square = 0;
  for (std::size_t c = 0; c < static_cast<std::size_t>(body_.dimension()); ++c) {
    double low = infinite, high = -infinite;
    for (const std::int32_t k : partners_[cell]) {
      low = std::min(low, low_[3 * static_cast<std::size_t>(k) + c]);
      high = std::max(high, high_[3 * static_cast<std::size_t>(k) + c]);
    }
    square += (high - low) * (high - low);
  }
  return std::sqrt(square) * caution;
}

std::vector<BondChange> BondMonitor::find(ConstFieldView u) {
  const std::size_t cells = partners_.size();
  constexpr std::size_t batch = 16;   // cells a task
  const auto over_cells = [&](auto&& body) {
    parallel_for((cells + batch - 1) / batch, [&](std::size_t b) {
      for (std::size_t c = b * batch; c < std::min(cells, (b + 1) * batch); ++c) body(c);
    });
  };
  if (skip_) over_cells([&](std::size_t c) { bound_motion(c, u); });
  over_cells([&](std::size_t c) {
    const double motion = skip_ ? relative_motion(c) : infinite;
    checks_[c] = 0;
    for (std::size_t g = cell_first_[c]; g < cell_first_[c + 1]; ++g) {
      margin_[g] -= motion;
      if (margin_[g] > 0) continue;   // a motion that is not a number is checked
      margin_[g] = check(groups_[g], u, found_[c]);
      ++checks_[c];
    }
  });
  std::vector<BondChange> all;
  for (std::size_t c = 0; c < cells; ++c) {
    checked_ += checks_[c];
    all.insert(all.end(), found_[c].begin(), found_[c].end());
    found_[c].clear();
  }
  return all;
}

std::size_t BondMonitor::bytes() const noexcept {
  std::size_t total = previous_.bytes() + groups_.size() * (sizeof(Group) + sizeof(double)) + (low_.size() + high_.size() + checks_.size() + cell_first_.size()) * 8;
  for (const auto& cells : partners_) total += cells.size() * sizeof(std::int32_t);
  return total;
}

}  // namespace perikit
