#pragma once
/// Input numbers of the points of a lattice that lie on several ranks: how many points come before them, x fastest.

#include <cstdint>
#include <span>
#include <vector>

#include "body/partition/lattice_shares.hpp"

namespace perikit {

/// For each row of cells along x in the box of this rank (y fastest, then z) the number of its first point there, where it has
/// `points` of them. boxes: of all ranks, along internal axes. Ranks share the rows of the whole lattice among them to add up, so
/// that nobody has all of them. All ranks must call it.
std::vector<std::int64_t> first_numbers_of_rows(const Lattice& lattice, const std::vector<CellBox>& boxes,
                                                std::span<const std::int64_t> points);

}  // namespace perikit
