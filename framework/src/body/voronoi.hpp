#pragma once
/// Voronoi cells of points: what is nearer to a point than to all others, inside of a box.

#include <span>
#include <vector>

#include "perikit/body/body.hpp"

namespace perikit {

struct VoronoiCells {
  std::vector<double> size;                           ///< length, area or volume of the cell [m^d]
  std::vector<double> reach;                          ///< distance of its farthest corner from its point [m]
  std::vector<std::vector<std::int32_t>> neighbours;  ///< points across its faces, where wanted
};

/// Cells in 1D, 2D or 3D, clipped at a box that holds all points. Points must be at different places. By Voro++ [Rycroft 2009].
VoronoiCells voronoi_cells(std::span<const Point> points, int dimension, const Point& lower, const Point& upper,
                           bool neighbours = false);

}  // namespace perikit
