#pragma once
#include "scene/scene.hpp"

namespace perikit {

/// Bodies above this number of points are refused, on however many ranks: they name points by whole numbers that a double holds.
/// What one rank can have is known when the body is built.
inline constexpr double largest_point_count = 4e15;

/// Estimated points of the bounding box of the lattice, as a double so that nothing overflows.
double lattice_point_count(const LatticeDescription& lattice, int dimension);

/// Why a crack has no area (3D) or length (2D) or is not plane; empty when it is sound. Tolerances are relative to its size.
std::string crack_fault(const std::vector<std::array<double, 3>>& vertices);

}  // namespace perikit
