#pragma once
#include <span>

#include "families/bonds.hpp"
#include "perikit/core/block_matrix.hpp"

namespace perikit {

/// Holds the ends of bonds that are no longer whole by 1e-9 of the mean stiffness of a point, so that pieces that nothing else
/// holds stay where they are. K: [N/m], with all points at the ends of `changed` among its rows.
void hold_loose_points(std::span<const BondChange> changed, BlockMatrix& K);

/// The block of a row on the diagonal.
double* diagonal_block(BlockMatrix& K, std::size_t row);

}  // namespace perikit
