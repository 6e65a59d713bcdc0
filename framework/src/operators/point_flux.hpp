#pragma once
#include <cstddef>
#include <cstdint>

#include "perikit/core/field.hpp"

namespace perikit {

/// Matrices at points, as a space keeps them. Without data: none.
struct PointMatrices {
  const double* data = nullptr;
  std::size_t by_point = 0, by_row = 0, by_column = 0;  ///< distances

  /// Of a field with component row * dimension + column.
  static PointMatrices of(ConstFieldView field, int dimension) noexcept {
    return {field.data, 1, static_cast<std::size_t>(dimension) * field.stride, field.stride};
  }
  double operator()(std::int32_t point, int row, int column) const noexcept {
    return data[static_cast<std::size_t>(point) * by_point + static_cast<std::size_t>(row) * by_row + static_cast<std::size_t>(column) * by_column];
  }
};

/// What an evaluation of forces leaves behind at points whose gradients are of order 1. Without data: nothing.
struct PointFlux {
  PointMatrices gradient;   ///< Hbar - I, by component and direction
  /// Likewise. Lattices: dE/dHbar K^-1 / spacing, K = sum of b omega d (x) d, d in cells, directions those of the axes of the grid. Clouds: dE/dHbar K^-1,
  /// K the shape tensor.
  PointMatrices flux;
  bool everywhere = false;  ///< else at points all of whose bonds were evaluated
};

}  // namespace perikit
