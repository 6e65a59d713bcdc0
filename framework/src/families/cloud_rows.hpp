#pragma once
/// What the loops over clouds share: point-major mirrors of fields, and blocks of points.

#include "families/blocks.hpp"
#include "families/counted_row.hpp"
#include "perikit/body/body.hpp"
#include "perikit/core/field.hpp"

namespace perikit {

/// Four doubles: a point-major row, so that one neighbour costs one cache line.
#if defined(PERIKIT_COUNT_OPERATIONS)
using Row = CountedRow;
#else
typedef double Row __attribute__((vector_size(32)));
#endif

constexpr std::size_t cloud_blocks(std::size_t points) noexcept {
  return (points + cloud_block_points - 1) / cloud_block_points;
}

/// Marks all groups of the pieces of so many points that have a marked one.
void complete_pieces(GroupMarks& marks, std::size_t points);

/// rows[p] <- components of u at p, zero in the rest, and fourth[p] in the last place where it is given.
void mirror_rows(ConstFieldView u, std::size_t points, AlignedVector<Row>& rows, const double* fourth = nullptr);

/// Blocks, and those that hold neighbours of them.
BlockReach cloud_reach(const FamilyLists& families, std::size_t points);

/// Colours of these blocks; on a part of a body those that they have in the whole one. Blocks wait for those that write to the same eight points.
Colouring cloud_colouring(const Body& body, const FamilyLists& families, const BlockReach& reach);

/// Whether a point of block b moves.
bool cloud_moves(ConstFieldView u, std::size_t b, std::size_t points) noexcept;

}  // namespace perikit
