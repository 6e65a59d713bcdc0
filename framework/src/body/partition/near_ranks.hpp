#pragma once
/// What ranks tell each other of their parts of a body.

#include <algorithm>
#include <iterator>
#include <vector>

#include "perikit/body/body.hpp"
#include "perikit/core/rank_values.hpp"

namespace perikit {

/// A box around points.
struct Bounds {
  Point low{}, high{};
  void add(const Point& x) noexcept {
    for (std::size_t a = 0; a < 3; ++a) {
      low[a] = std::min(low[a], x[a]);
      high[a] = std::max(high[a], x[a]);
    }
  }
  bool near(const Point& x, double distance) const noexcept {
    for (std::size_t a = 0; a < 3; ++a)
      if (x[a] < low[a] - distance || x[a] > high[a] + distance) return false;
    return true;
  }
};

/// Of all points that a rank has.
Bounds bounds_of(const Body& body);

/// The sum of what is there of a part of a body on all ranks, which must all call it; of a body that is no part what is there.
double total_of(const Body& body, const ExactSum& sum);

/// What ranks have at places `x` that lie no farther than this from the bounds of the rank's part; of a body that is no part what
/// it has itself. Rank by rank. All ranks must call it; a rank without others has its own.
template <class T>
std::vector<T> of_ranks_near(const Body& body, const std::vector<T>& mine, double distance) {
  if (!body.part()) return mine;
  const Bounds bounds = bounds_of(body);
  std::vector<Bounds> of_ranks = told_to_all(gathered<Bounds>({&bounds, 1}));
  of_ranks.resize(static_cast<std::size_t>(communicator().size()), bounds);
  std::vector<std::vector<T>> to(of_ranks.size());
  for (std::size_t r = 0; r < to.size(); ++r)
    std::ranges::copy_if(mine, std::back_inserter(to[r]), [&](const T& one) { return of_ranks[r].near(one.x, distance); });
  std::vector<T> near;
  for (const std::vector<T>& of_rank : exchanged(to)) near.insert(near.end(), of_rank.begin(), of_rank.end());
  return near;
}

}  // namespace perikit
