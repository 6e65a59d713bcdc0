#pragma once
#include "perikit/core/field.hpp"

namespace perikit {

/// What an evaluation of forces leaves behind at the points of a lattice whose gradients are of order 1. Without data: nothing.
struct PointFlux {
  ConstFieldView gradient;  ///< Hbar - I, [c * dimension + e]
  ConstFieldView flux;      ///< dE/dHbar K^-1 / spacing [J/m], K = sum of b omega d (x) d, d in cells: [c * dimension + e], e an axis of the grid
  bool everywhere = false;  ///< else at points all of whose bonds were evaluated
};

}  // namespace perikit
