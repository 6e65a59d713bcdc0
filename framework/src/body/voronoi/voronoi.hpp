#pragma once
/// Voronoi cells of points: what is nearer to a point than to all others, inside of a box. Cells are cut by Voro++ [Rycroft
/// 2009], by nearer points first, so that every bit of a cell follows from those points that might cut it, whatever else is
/// there.

#include <span>
#include <vector>

#include "perikit/body/body.hpp"

namespace perikit {

struct VoronoiCells {
  std::vector<double> size;                           ///< length, area or volume of the cell [m^d]
  std::vector<double> reach;                          ///< distance of its farthest corner from its point [m]
  std::vector<std::vector<std::int32_t>> neighbours;  ///< points across its faces, where wanted
};

/// Cells in 1D, 2D or 3D, clipped at a box that holds all points. Points must be at different places.
VoronoiCells voronoi_cells(std::span<const Point> points, int dimension, const Point& lower, const Point& upper,
                           bool neighbours = false);

/// What a rank finds of the cells of points that no rank has as a whole.
struct SharedCells {
  VoronoiCells cells;
  std::vector<Point> points;          ///< those of the cells come first; neighbours are among them
  std::vector<std::int64_t> numbers;  ///< of the points: where they come in the input
};

/// run: this rank's run of the points in the order of the input, after those of lower ranks. Each rank gets the cells of points
/// that lie together, the same as `voronoi_cells` of all points, in every bit. All ranks must call it.
SharedCells shared_voronoi_cells(const std::vector<Point>& run, int dimension, const Point& lower, const Point& upper,
                                 bool neighbours);

}  // namespace perikit
