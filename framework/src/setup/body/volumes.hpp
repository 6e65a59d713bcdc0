#pragma once
/// Volumes of points where the shape of a body cuts their cells. Shares are counted on fixed grids of samples in a cell.

#include <vector>

#include "perikit/body/body.hpp"
#include "scene/expressions/expression.hpp"

namespace perikit {

/// Length, area or volume of the Voronoi cells of the points inside of a box and, unless it is null, of `inside`. run: these are
/// the rank's run of the points of all ranks, which must all call it.
std::vector<double> voronoi_volumes(const std::vector<Point>& points, int dimension, const Point& lower, const Point& upper,
                                    const Expression* inside, bool run);

/// What of the cell of a lattice around a place is inside: its share of the cell and its centroid.
struct PartOfCell {
  double share = 0;
  Point centroid{};
};
PartOfCell part_inside(const Expression& inside, const Point& centre, double spacing, int dimension);

}  // namespace perikit
