#pragma once
/// From points to their Voronoi cells, of which each is found by itself.

#include <algorithm>
#include <memory>
#include <span>
#include <vector>

#include "body/points/place_tree.hpp"
#include "body/voronoi/voronoi.hpp"
#include "body/voronoi/voronoi_cell.hpp"
#include "perikit/core/parallel.hpp"

namespace perikit {

/// Clips the cells of a body.
struct VoronoiBox {
  int dimension;
  Point lower, upper;
  double unit;  ///< mean distance of the points [m]
  VoronoiBox(int dimension, const Point& lower, const Point& upper, std::int64_t points);
};

struct VoronoiPoints {
  std::vector<Point> x;
  std::vector<std::int64_t> number;  ///< says which of two points at the same distance comes first
};

class CellSearch {
 public:
  /// tree: of the first ones of the points. known: of those whose cells are sought, all points up to this distance are in it [m].
  CellSearch(const VoronoiBox& box, const VoronoiPoints& points, const PlaceTree& tree, double known)
      : points_(points), tree_(tree), known_squared_(known * known), cell_(box.dimension, box.lower, box.upper, box.unit) {}

  /// The cell of the n-th point. further: those that might cut it beyond the known distance; without them it may be too large.
  VoronoiCell& find(std::int32_t n, std::span<const std::int32_t> further = {});
  /// Whether points beyond the known distance might cut a cell.
  bool unsure(const VoronoiCell& cell) const { return limit(cell) > known_squared_; }
  /// Appends those of the first `count` points beyond the known distance that might cut a cell around x, which another rank has
  /// found without them.
  void over_further(const Point& x, const VoronoiCell& cell, std::int32_t count, std::vector<std::int32_t>& found) const;

 private:
  struct Next {
    double square;        ///< of its distance from the point [m^2]
    std::int64_t number;  ///< -1: it is a node of the tree
    std::int32_t index;
  };
  struct Later {
    bool operator()(const Next& a, const Next& b) const noexcept {
      return a.square > b.square || (a.square == b.square && a.number > b.number);
    }
  };
  /// Nothing farther away cuts a cell: the square of the distance [m^2].
  static double limit(const VoronoiCell& cell) { return 4 * cell.reach_squared() * (1 + 1e-9); }
  const Point& place(std::int32_t n) const noexcept { return points_.x[static_cast<std::size_t>(n)]; }
  void push(const Next& next);
  void push_point(const Point& x, std::int32_t n, double most);
  void push_node(const Point& x, std::int32_t node);

  const VoronoiPoints& points_;
  const PlaceTree& tree_;
  double known_squared_;
  VoronoiCell cell_;
  std::vector<Next> next_;  ///< a heap, the nearest first
};

/// visit(search, k) for k = 0 ... count - 1, by threads, each of which has a search of its own; it begins with these arguments.
template <class Visit, class... Arguments>
void with_searches(std::size_t count, Visit&& visit, const Arguments&... arguments) {
  std::vector<std::unique_ptr<CellSearch>> searches(static_cast<std::size_t>(thread_count()));
  for (auto& search : searches) search = std::make_unique<CellSearch>(arguments...);
  constexpr std::size_t block = 64;
  parallel_for((count + block - 1) / block, [&](std::size_t b) {
    CellSearch& search = *searches[static_cast<std::size_t>(thread_index())];
    for (std::size_t k = b * block; k < std::min(count, (b + 1) * block); ++k) visit(search, k);
  });
}

/// Room for so many cells, and what becomes of the n-th one.
VoronoiCells room_for_cells(std::size_t count, bool neighbours);
void keep_cell(VoronoiCell& cell, std::size_t n, VoronoiCells& cells);

}  // namespace perikit
