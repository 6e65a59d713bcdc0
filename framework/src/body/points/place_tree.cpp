#include "body/points/place_tree.hpp"

#include <algorithm>
#include <numeric>

namespace perikit {

PlaceTree::PlaceTree(std::span<const Point> places) : order_(places.size()) {
  std::iota(order_.begin(), order_.end(), 0);
  if (!places.empty()) add(places, 0, static_cast<std::int32_t>(places.size()));
}

/// The places in halves across the longest side, until few are left.
void PlaceTree::add(std::span<const Point> places, std::int32_t first, std::int32_t last) {
  constexpr std::int32_t few = 8;
  const auto place = [&](std::int32_t n) -> const Point& { return places[static_cast<std::size_t>(n)]; };
  const auto begin = order_.begin();
  Point low = place(begin[first]), high = low;
  for (std::int32_t k = first; k < last; ++k)
    for (std::size_t c = 0; c < 3; ++c) {
      low[c] = std::min(low[c], place(begin[k])[c]);
      high[c] = std::max(high[c], place(begin[k])[c]);
    }
  const std::size_t node = nodes_.size();
  nodes_.push_back({low, high, first, last, 0});
  if (last - first <= few) return;
  std::size_t axis = 0;
  for (std::size_t c = 1; c < 3; ++c)
    if (high[c] - low[c] > high[axis] - low[axis]) axis = c;
  const std::int32_t middle = first + (last - first) / 2;
  std::nth_element(begin + first, begin + middle, begin + last,
                   [&](std::int32_t a, std::int32_t b) { return place(a)[axis] < place(b)[axis]; });
  add(places, first, middle);
  nodes_[node].second = static_cast<std::int32_t>(nodes_.size());
  add(places, middle, last);
}

}  // namespace perikit
