#pragma once
/// A regular lattice inside padded rows: the neighbour at integer offset d of the point with index p is the point p + shift(d),
/// for every point, without a list.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace perikit {

/// Internal axes: axis 0 is the longest one (rows are contiguous along it), then the others. Index of the cell (k0, k1, k2):
/// base + k0 + pitch[0] * (k1 + pitch[1] * k2). Rows and planes are followed by at least `reach` dead cells, so that
/// a shift that leaves the body lands on a dead cell, never on a point of another row.
struct Lattice {
  int dimension = 3;
  double spacing = 0;
  std::array<double, 3> lower{};                ///< input axes
  std::array<int, 3> axis{0, 1, 2};             ///< internal axis k runs along input axis axis[k]
  std::array<std::int64_t, 3> extent{1, 1, 1};  ///< cells along the internal axes
  /// Of the lattice that this one is a box of, and where the box begins in it, along axis 0 at a multiple of `padding`.
  std::array<std::int64_t, 3> whole{1, 1, 1}, first{};
  std::array<std::int64_t, 3> origin{};        ///< where the whole begins, in cells from `lower`: below it where there are images
  std::array<std::int64_t, 3> pitch{0, 0, 0};  ///< pitch[0]: cells from row to row; pitch[1]: rows from plane to plane
  std::int64_t base = 0;
  std::int64_t cells = 0;  ///< size of a field component: a multiple of `padding`
  std::int64_t reach = 0;  ///< largest |shift|

  std::int64_t index(std::int64_t k0, std::int64_t k1, std::int64_t k2) const noexcept {
    return base + k0 + pitch[0] * (k1 + pitch[1] * k2);
  }
  std::array<std::int64_t, 3> cell(std::int64_t index) const noexcept;
  std::array<double, 3> position(std::int64_t index) const noexcept { return centre(cell(index)); }
  std::array<double, 3> centre(const std::array<std::int64_t, 3>& cell) const noexcept;
  /// Of a lattice that is no box: the number of a cell in the order of the input, x fastest, and the cell of a number.
  std::int64_t input_number(const std::array<std::int64_t, 3>& cell) const noexcept;
  std::array<std::int64_t, 3> cell_of_input(std::int64_t number) const noexcept;
  /// The cell around a place, which may lie beyond the extent.
  std::array<std::int64_t, 3> around(const std::array<double, 3>& x) const noexcept;
  std::int64_t shift(const std::array<int, 3>& offset) const noexcept {
    return offset[0] + pitch[0] * (offset[1] + pitch[1] * offset[2]);
  }
};

/// Cells along one axis: points at lower + (k + 1/2) spacing, up to upper.
std::int64_t lattice_cells(double lower, double upper, double spacing);

/// `horizon` limits the padding; offsets beyond the extent of the body never occur and need none.
Lattice make_lattice(int dimension, double spacing, const std::array<double, 3>& lower, const std::array<double, 3>& upper,
                     double horizon);

/// The cells low ... high - 1 along the axes of the input, counted from the first one of a lattice that is no box: more than that
/// has, or fewer. Cells that both have are at the same places, bit for bit.
Lattice regrown(const Lattice& lattice, const std::array<std::int64_t, 3>& low, const std::array<std::int64_t, 3>& high,
                double horizon);

/// The cells first ... last - 1 (internal axes) of a lattice that is no box itself.
Lattice box_of(const Lattice& lattice, const std::array<std::int64_t, 3>& first, const std::array<std::int64_t, 3>& last,
               double horizon);

/// Blocks of cells that loops run over: rows times segments along the rows, small enough for the second-level cache and to share
/// out among threads. They are those of the whole lattice; a box has what it holds of them.
struct LatticeTiling {
  explicit LatticeTiling(const Lattice& lattice);
  std::array<std::int64_t, 3> size;   ///< of a tile: groups of `padding` cells along axis 0, cells along the others
  std::array<std::int64_t, 3> count;  ///< of tiles along the internal axes
  std::int64_t tiles() const noexcept { return count[0] * count[1] * count[2]; }
  std::int64_t number(const std::array<std::int64_t, 3>& tile) const noexcept {
    return tile[0] + count[0] * (tile[1] + count[1] * tile[2]);
  }
  /// The tile of a cell of the whole lattice.
  std::array<std::int64_t, 3> of(const std::array<std::int64_t, 3>& cell) const noexcept;
};

/// Few colours for tiles, such that the families of two tiles of one colour touch disjoint cells. Across rows the colour is first
/// i + second j modulo the least number for which that holds, which for discs of rows are fewer than for squares.
class TileColours {
 public:
  /// offsets: of the bonds of a family, internal axes [cells].
  TileColours(const LatticeTiling& tiling, std::span<const std::array<int, 3>> offsets);
  std::int32_t of(std::int64_t number) const noexcept;

 private:
  LatticeTiling tiling_;
  std::int64_t along_, across_, first_ = 1, second_ = 1;  ///< colours along rows and across them
};

/// Integer offsets (internal axes) of the bonds of a whole family: |d| spacing <= horizon (1 + 1e-10), d != 0. The first half
/// holds one of each pair +d, -d; slot s + half is the reverse of slot s. Within a half axis 0 varies slowest.
std::vector<std::array<int, 3>> family_offsets(const Lattice& lattice, double horizon);

}  // namespace perikit
