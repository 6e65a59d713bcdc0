#pragma once
/// Points for the cells of a lattice that the surface of a body cuts.

#include <vector>

#include "perikit/body/body.hpp"
#include "perikit/body/lattice.hpp"
#include "perikit/core/rank_values.hpp"
#include "scene/expressions/expression.hpp"

namespace perikit {

struct PartialCells {
  std::vector<Point> position;
  std::vector<double> volume;  ///< over that of a whole cell
};

/// Cells with half of their volume or more inside have a point at the centroid of what is inside; what other cells have inside
/// goes to the nearest of these, so that nothing of the body is lost. layers: which of those across the last axis.
PartialCells cells_inside(const Expression& inside, const Lattice& lattice, const Run& layers);

}  // namespace perikit
