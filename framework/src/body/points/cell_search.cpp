#include "body/points/cell_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "body/points/boxes.hpp"

namespace perikit {

namespace {

/// Never inlined, for the compiler may fuse products and sums in one place and not in another, and points must come in the same
/// order wherever they are from.
[[gnu::noinline]] double squared_distance(const Point& a, const Point& b) {
  const Point d = b - a;
  return dot(d, d);
}

}  // namespace

VoronoiBox::VoronoiBox(int d, const Point& low, const Point& high, std::int64_t points) : dimension(d), lower(low), upper(high) {
  double size = 1;
  for (std::size_t c = 0; c < static_cast<std::size_t>(d); ++c) size *= upper[c] - lower[c];
  unit = std::pow(size / static_cast<double>(points), 1.0 / d);
}

void CellSearch::push(const Next& next) {
  next_.push_back(next);
  std::push_heap(next_.begin(), next_.end(), Later());
}

void CellSearch::push_point(const Point& x, std::int32_t n, double most) {
  const double square = squared_distance(x, place(n));
  if (square <= most && square <= limit(cell_)) push({square, points_.number[static_cast<std::size_t>(n)], n});
}

void CellSearch::push_node(const Point& x, std::int32_t node) {
  const PlaceTree::Node& box = tree_.nodes()[static_cast<std::size_t>(node)];
  Point nearest = x;
  for (std::size_t c = 0; c < 3; ++c) nearest[c] = std::clamp(x[c], box.low[c], box.high[c]);
  // Rounded down, so that it comes before all points that it holds.
  const double square = squared_distance(x, nearest) * (1 - 1e-12);
  if (square <= known_squared_ && square <= limit(cell_)) push({square, -1, node});
}

VoronoiCell& CellSearch::find(std::int32_t n, std::span<const std::int32_t> further) {
  const Point& x = place(n);
  cell_.begin(x);
  next_.clear();
  push_node(x, 0);
  for (const std::int32_t other : further) push_point(x, other, std::numeric_limits<double>::infinity());
  while (!next_.empty()) {
    std::pop_heap(next_.begin(), next_.end(), Later());
    const Next next = next_.back();
    next_.pop_back();
    if (next.square > limit(cell_)) break;
    if (next.number >= 0) {
      cell_.cut(place(next.index), next.index);
      continue;
    }
    const PlaceTree::Node& node = tree_.nodes()[static_cast<std::size_t>(next.index)];
    if (!cell_.cut_from(node.low, node.high)) continue;
    if (node.second > 0) {
      push_node(x, next.index + 1);
      push_node(x, node.second);
      continue;
    }
    for (const std::int32_t other : tree_.places(node))
      if (other != n) push_point(x, other, known_squared_);
  }
  return cell_;
}

void CellSearch::over_further(const Point& x, const VoronoiCell& cell, std::int32_t count,
                              std::vector<std::int32_t>& found) const {
  if (tree_.nodes().empty()) return;
  std::vector<std::int32_t> nodes{0};
  while (!nodes.empty()) {
    const std::int32_t index = nodes.back();
    nodes.pop_back();
    const PlaceTree::Node& node = tree_.nodes()[static_cast<std::size_t>(index)];
    if (!cell.cut_from(node.low, node.high)) continue;
    if (node.second > 0) {
      nodes.push_back(node.second);
      nodes.push_back(index + 1);
      continue;
    }
    for (const std::int32_t n : tree_.places(node))
      if (n < count && squared_distance(x, place(n)) > known_squared_ && cell.cut_from(place(n), place(n))) found.push_back(n);
  }
}

VoronoiCells room_for_cells(std::size_t count, bool neighbours) {
  VoronoiCells cells{std::vector<double>(count), std::vector<double>(count), {}};
  if (neighbours) cells.neighbours.resize(count);
  return cells;
}

void keep_cell(VoronoiCell& cell, std::size_t n, VoronoiCells& cells) {
  cells.size[n] = cell.size();
  cells.reach[n] = std::sqrt(cell.reach_squared());
  if (!cells.neighbours.empty()) cells.neighbours[n] = cell.neighbours();
}

}  // namespace perikit
