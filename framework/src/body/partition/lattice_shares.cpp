#include "body/partition/lattice_shares.hpp"

#include <algorithm>
#include <cmath>

#include "perikit/core/communicator.hpp"
#include "perikit/core/field.hpp"

namespace perikit {

namespace {

constexpr auto group = static_cast<std::int64_t>(padding);

/// visit(k) for the cells of a box.
template <class Visit>
void over_cells(const CellBox& box, Visit&& visit) {
  std::array<std::int64_t, 3> k{};
  for (k[2] = box.low[2]; k[2] < box.high[2]; ++k[2])
    for (k[1] = box.low[1]; k[1] < box.high[1]; ++k[1])
      for (k[0] = box.low[0]; k[0] < box.high[0]; ++k[0]) visit(k);
}

/// The cells of a box of tiles.
CellBox cells_of(const LatticeTiling& tiling, const std::array<std::int64_t, 3>& extent, const CellBox& tiles) {
  CellBox cells;
  for (std::size_t a = 0; a < 3; ++a) {
    const std::int64_t size = tiling.size[a] * (a == 0 ? group : 1);
    cells.low[a] = tiles.low[a] * size;
    cells.high[a] = std::min(extent[a], tiles.high[a] * size);
  }
  return cells;
}

}  // namespace

std::vector<std::int64_t> points_in_tiles(const Lattice& lattice, const CellBox& box, const Inside& inside) {
  const LatticeTiling tiling(lattice);
  std::vector<std::int64_t> points(static_cast<std::size_t>(tiling.tiles()), 0);
  // A rank without others counts for them.
  const Communicator& ranks = communicator();
  const auto first = static_cast<std::size_t>(ranks.complete() ? ranks.rank() : 0),
             step = static_cast<std::size_t>(ranks.complete() ? ranks.size() : 1);
  std::size_t number = 0;
  over_cells({{}, tiling.count}, [&](const std::array<std::int64_t, 3>& tile) {
    const std::size_t own = number++;
    if (inside && own % step != first) return;
    const CellBox cells = common(box, cells_of(tiling, lattice.extent, {tile, {tile[0] + 1, tile[1] + 1, tile[2] + 1}}));
    if (!inside) {
      points[own] = cells.cells();
      return;
    }
    over_cells(cells, [&](const std::array<std::int64_t, 3>& k) { points[own] += inside(lattice.centre(k)); });
  });
  if (inside) communicator().sum(points);
  return points;
}

LatticeShares::LatticeShares(const Lattice& lattice, std::vector<std::int64_t> points, int ranks)
    : tiling_(lattice),
      extent_(lattice.extent),
      points_(std::move(points)),
      rank_(points_.size(), 0),
      box_(static_cast<std::size_t>(ranks)),
      of_rank_(static_cast<std::size_t>(ranks), 0) {
  share({{}, tiling_.count}, 0, ranks);
}

/// Ranks first ... first + ranks - 1 get these tiles: cut across the longest side, near where the points divide as the ranks.
void LatticeShares::share(const CellBox& tiles, int first, int ranks) {
  if (ranks == 1) {
    over_cells(tiles,
               [&](const std::array<std::int64_t, 3>& tile) { rank_[static_cast<std::size_t>(tiling_.number(tile))] = first; });
    box_[static_cast<std::size_t>(first)] = cells_of(tiling_, extent_, tiles);
    of_rank_[static_cast<std::size_t>(first)] = count(tiles);
    return;
  }
  std::size_t axis = 3;
  std::int64_t longest = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    const std::int64_t length = tiles.length(a) * tiling_.size[a] * (a == 0 ? group : 1);
    if (tiles.length(a) > 1 && length > longest) axis = a, longest = length;
  }
  if (axis == 3) return share(tiles, first, 1);  // one tile for several ranks: the others are left without points
  std::vector<std::int64_t> layer;               // points in each layer of tiles along the axis
  for (std::int64_t k = tiles.low[axis]; k < tiles.high[axis]; ++k) {
    CellBox one = tiles;
    one.low[axis] = k;
    one.high[axis] = k + 1;
    layer.push_back(count(one));
  }
  std::int64_t all = 0;
  for (const std::int64_t points : layer) all += points;
  const int lower = ranks / 2;
  const double wanted = static_cast<double>(all) * lower / ranks;
  std::int64_t cut = tiles.low[axis] + 1, below = 0;
  double nearest = -1;
  for (std::int64_t k = tiles.low[axis] + 1; k < tiles.high[axis]; ++k) {
    below += layer[static_cast<std::size_t>(k - tiles.low[axis] - 1)];
    const double off = std::abs(static_cast<double>(below) - wanted);
    if (nearest < 0 || off < nearest) cut = k, nearest = off;
  }
  CellBox low = tiles, high = tiles;
  low.high[axis] = high.low[axis] = cut;
  share(low, first, lower);
  share(high, first + lower, ranks - lower);
}

std::int64_t LatticeShares::count(const CellBox& tiles) const {
  std::int64_t sum = 0;
  over_cells(tiles,
             [&](const std::array<std::int64_t, 3>& tile) { sum += points_[static_cast<std::size_t>(tiling_.number(tile))]; });
  return sum;
}

}  // namespace perikit
