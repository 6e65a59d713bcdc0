#include "body/voronoi.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <voro++/voro++.hh>

#include "perikit/core/parallel.hpp"

namespace perikit {

namespace {

VoronoiCells make_cells(std::size_t n, bool neighbours) {
  VoronoiCells cells{std::vector<double>(n), std::vector<double>(n), {}};
  if (neighbours) cells.neighbours.resize(n);
  return cells;
}

/// On a line cells end half-way between points.
VoronoiCells intervals(std::span<const Point> points, double lower, double upper, bool neighbours) {
  std::vector<std::size_t> order(points.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, {}, [&](std::size_t n) { return points[n][0]; });
  VoronoiCells cells = make_cells(points.size(), neighbours);
  double begin = lower;
  for (std::size_t k = 0; k < order.size(); ++k) {
    const double x = points[order[k]][0], end = k + 1 < order.size() ? 0.5 * (x + points[order[k + 1]][0]) : upper;
    cells.size[order[k]] = end - begin;
    cells.reach[order[k]] = std::max(x - begin, end - x);
    if (neighbours && k > 0) cells.neighbours[order[k]].push_back(static_cast<std::int32_t>(order[k - 1]));
    if (neighbours && k + 1 < order.size()) cells.neighbours[order[k]].push_back(static_cast<std::int32_t>(order[k + 1]));
    begin = end;
  }
  return cells;
}

}  // namespace

VoronoiCells voronoi_cells(std::span<const Point> points, int dimension, const Point& lower, const Point& upper,
                           bool neighbours) {
  if (dimension == 1) return intervals(points, lower[0], upper[0], neighbours);
  const auto d = static_cast<std::size_t>(dimension);
  double box = 1;
  for (std::size_t c = 0; c < d; ++c) box *= upper[c] - lower[c];
  // Lengths over the mean distance of points, for the library's tolerances; a slab of thickness 1 in two dimensions.
  const double unit = std::pow(box / static_cast<double>(points.size()), 1.0 / dimension);
  double high[3] = {1, 1, 1}, low[3] = {0, 0, 0};
  int boxes[3] = {1, 1, 1};
  constexpr double points_in_box = 4;
  for (std::size_t c = 0; c < d; ++c) {
    high[c] = (upper[c] - lower[c]) / unit;
    boxes[c] = std::max(1, static_cast<int>(high[c] / std::pow(points_in_box, 1.0 / dimension)));
  }
  voro::container container(low[0], high[0], low[1], high[1], low[2], high[2], boxes[0], boxes[1], boxes[2], false, false, false,
                            8);
  for (std::size_t n = 0; n < points.size(); ++n) {
    double x[3] = {0.5, 0.5, 0.5};
    for (std::size_t c = 0; c < d; ++c) x[c] = (points[n][c] - lower[c]) / unit;
    container.put(static_cast<int>(n), x[0], x[1], x[2]);
  }
  VoronoiCells cells = make_cells(points.size(), neighbours);
  // One searcher a thread; cells do not depend on which.
  using Searcher = voro::voro_compute<voro::container>;
  std::vector<std::unique_ptr<Searcher>> searchers(static_cast<std::size_t>(thread_count()));
  for (auto& searcher : searchers) searcher = std::make_unique<Searcher>(container, boxes[0], boxes[1], boxes[2]);
  const auto layer = static_cast<std::size_t>(boxes[0]);
  parallel_for(static_cast<std::size_t>(boxes[1]) * static_cast<std::size_t>(boxes[2]), [&](std::size_t row) {
    Searcher& searcher = *searchers[static_cast<std::size_t>(thread_index())];
    voro::voronoicell_neighbor cell;
    std::vector<double> corners;
    std::vector<int> across;
    for (std::size_t i = 0; i < layer; ++i) {
      const int ijk = static_cast<int>(row * layer + i), j = static_cast<int>(row) % boxes[1],
                k = static_cast<int>(row) / boxes[1];
      for (int q = 0; q < container.co[ijk]; ++q) {
        if (!searcher.compute_cell(cell, ijk, q, static_cast<int>(i), j, k)) continue;
        const auto n = static_cast<std::size_t>(container.id[ijk][q]);
        cells.size[n] = cell.volume() * std::pow(unit, dimension);
        cell.vertices(corners);
        double farthest = 0;
        for (std::size_t v = 0; v + 2 < corners.size(); v += 3) {
          double square = 0;
          for (std::size_t c = 0; c < d; ++c) square += corners[v + c] * corners[v + c];
          farthest = std::max(farthest, square);
        }
        cells.reach[n] = std::sqrt(farthest) * unit;
        if (!neighbours) continue;
        cell.neighbors(across);
        for (const int other : across)
          if (other >= 0) cells.neighbours[n].push_back(other);  // sides of the box have negative numbers
      }
    }
  });
  return cells;
}

}  // namespace perikit
