#pragma once
/// Which rank owns which cells of a lattice: boxes of tiles with about equal numbers of points.

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "perikit/body/lattice.hpp"

namespace perikit {

/// The cells low ... high - 1 along internal axes; empty where one high is not above its low.
struct CellBox {
  std::array<std::int64_t, 3> low{}, high{};
  bool holds(const std::array<std::int64_t, 3>& k) const noexcept {
    return k[0] >= low[0] && k[0] < high[0] && k[1] >= low[1] && k[1] < high[1] && k[2] >= low[2] && k[2] < high[2];
  }
  /// Cells along an axis.
  std::int64_t length(std::size_t axis) const noexcept { return high[axis] > low[axis] ? high[axis] - low[axis] : 0; }
  std::int64_t cells() const noexcept { return length(0) * length(1) * length(2); }
};

/// The cells that both have.
inline CellBox common(const CellBox& a, const CellBox& b) {
  CellBox box;
  for (std::size_t c = 0; c < 3; ++c) box.low[c] = std::max(a.low[c], b.low[c]), box.high[c] = std::min(a.high[c], b.high[c]);
  return box;
}

/// visit(k) for the cells of a box in the order of the input: x fastest.
template <class Visit>
void in_input_order(const Lattice& lattice, const CellBox& box, Visit&& visit) {
  std::array<std::size_t, 3> inner{};  // internal axis along each input axis
  for (std::size_t k = 0; k < 3; ++k) inner[static_cast<std::size_t>(lattice.axis[k])] = k;
  const auto [x, y, z] = inner;
  std::array<std::int64_t, 3> k{};
  for (k[z] = box.low[z]; k[z] < box.high[z]; ++k[z])
    for (k[y] = box.low[y]; k[y] < box.high[y]; ++k[y])
      for (k[x] = box.low[x]; k[x] < box.high[x]; ++k[x]) visit(k);
}

/// Whether a body has a point here; empty: everywhere.
using Inside = std::function<bool(const std::array<double, 3>&)>;

/// Points in each tile of a lattice, which is no box itself; only cells of `box` have any. Each rank counts some tiles; all ranks must
/// call it.
std::vector<std::int64_t> points_in_tiles(const Lattice& lattice, const CellBox& box, const Inside& inside);
inline std::vector<std::int64_t> points_in_tiles(const Lattice& lattice, const Inside& inside) {
  return points_in_tiles(lattice, {{}, lattice.extent}, inside);
}

class LatticeShares {
 public:
  /// points: in each tile.
  LatticeShares(const Lattice& lattice, std::vector<std::int64_t> points, int ranks);

  int owner(const std::array<std::int64_t, 3>& cell) const noexcept {
    return rank_[static_cast<std::size_t>(tiling_.number(tiling_.of(cell)))];
  }
  const CellBox& box(int rank) const noexcept { return box_[static_cast<std::size_t>(rank)]; }
  const std::vector<CellBox>& boxes() const noexcept { return box_; }
  /// Points of each rank.
  const std::vector<std::int64_t>& points() const noexcept { return of_rank_; }

 private:
  void share(const CellBox& tiles, int first, int ranks);
  std::int64_t count(const CellBox& tiles) const;

  LatticeTiling tiling_;
  std::array<std::int64_t, 3> extent_;
  std::vector<std::int64_t> points_;
  std::vector<int> rank_;  ///< by tile
  std::vector<CellBox> box_;
  std::vector<std::int64_t> of_rank_;
};

}  // namespace perikit
