#include "body/voronoi/voronoi.hpp"

#include <limits>
#include <numeric>

#include "body/points/cell_search.hpp"

namespace perikit {

VoronoiCells voronoi_cells(std::span<const Point> points, int dimension, const Point& lower, const Point& upper,
                           bool neighbours) {
  VoronoiPoints all{{points.begin(), points.end()}, std::vector<std::int64_t>(points.size())};
  std::iota(all.number.begin(), all.number.end(), std::int64_t{0});
  const PlaceTree tree(all.x);
  VoronoiCells cells = room_for_cells(points.size(), neighbours);
  with_searches(
      points.size(), [&](CellSearch& search, std::size_t n) { keep_cell(search.find(static_cast<std::int32_t>(n)), n, cells); },
      VoronoiBox(dimension, lower, upper, std::ssize(points)), all, tree, std::numeric_limits<double>::infinity());
  return cells;
}

}  // namespace perikit
