#include "perikit/body/partition.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "perikit/body/images.hpp"

namespace perikit {

namespace {

/// Coordinate along the longest side of the body, by input number.
std::vector<double> along_longest_side(const Body& body) {
  std::array<double, 3> low, high;
  low.fill(std::numeric_limits<double>::infinity());
  high.fill(-std::numeric_limits<double>::infinity());
  for (const std::int32_t p : body.internal()) {
    const Point x = body.position(static_cast<std::size_t>(p));
    for (std::size_t a = 0; a < 3; ++a) low[a] = std::min(low[a], x[a]), high[a] = std::max(high[a], x[a]);
  }
  std::size_t axis = 0;
  for (std::size_t a = 1; a < 3; ++a)
    if (high[a] - low[a] > high[axis] - low[axis]) axis = a;
  std::vector<double> along;
  for (const std::int32_t p : body.internal()) along.push_back(body.position(static_cast<std::size_t>(p))[axis]);
  return along;
}

}  // namespace

Partition::Partition(Body whole, int rank, int size)
    : whole_(std::move(whole)), owned_(whole_.points(), false), kept_(whole_.points(), false), place_(whole_.points(), -1),
      lent_(static_cast<std::size_t>(size)), borrowed_(static_cast<std::size_t>(size)) {
  const std::vector<double> along = along_longest_side(whole_);
  const auto n = static_cast<std::int64_t>(along.size());
  std::vector<std::int32_t> order(along.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](std::int32_t a, std::int32_t b) { return along[static_cast<std::size_t>(a)] < along[static_cast<std::size_t>(b)]; });
  std::vector<int> rank_of(along.size());
  std::vector<double> low(static_cast<std::size_t>(size), std::numeric_limits<double>::infinity()), high(low.size(), -low.front());
  for (std::int64_t k = 0; k < n; ++k) {
    const auto p = static_cast<std::size_t>(order[static_cast<std::size_t>(k)]);
    const auto r = static_cast<std::size_t>(k * size / n);
    rank_of[p] = static_cast<int>(r);
    low[r] = std::min(low[r], along[p]);
    high[r] = std::max(high[r], along[p]);
  }
  const double reach = halo(whole_);
  const auto keeps = [&](std::size_t r, std::size_t p) { return along[p] >= low[r] - reach && along[p] <= high[r] + reach; };
  const auto mine = static_cast<std::size_t>(rank);
  for (std::size_t p = 0; p < along.size(); ++p) {
    const auto owner = static_cast<std::size_t>(rank_of[p]);
    owned_[p] = owner == mine;
    kept_[p] = owned_[p] || keeps(mine, p);
    if (!kept_[p]) continue;
    place_[p] = static_cast<std::int32_t>(inputs_.size());
    inputs_.push_back(static_cast<std::int32_t>(p));
    if (!owned_[p]) borrowed_[owner].push_back(static_cast<std::int32_t>(p));
    for (std::size_t r = 0; r < low.size() && owned_[p]; ++r)
      if (r != mine && keeps(r, p)) lent_[r].push_back(static_cast<std::int32_t>(p));
  }
}

}  // namespace perikit
