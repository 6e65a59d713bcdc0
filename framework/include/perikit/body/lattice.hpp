#pragma once
/// A regular lattice inside padded rows: the neighbour at integer offset d of the point with index p is the point p + shift(d),
/// for every point, without a list.

#include <array>
#include <cstdint>
#include <vector>

namespace perikit {

/// Internal axes: axis 0 is the longest one (rows are contiguous along it), then the others. Index of the cell (k0, k1, k2):
/// base + k0 + pitch[0] * (k1 + pitch[1] * k2). Rows and planes are followed by at least `reach` dead cells, so that
/// a shift that leaves the body lands on a dead cell, never on a point of another row.
struct Lattice {
  int dimension = 3;
  double spacing = 0;
  std::array<double, 3> lower{};              ///< input axes
  std::array<int, 3> axis{0, 1, 2};           ///< internal axis k runs along input axis axis[k]
  std::array<std::int64_t, 3> extent{1, 1, 1};///< cells along the internal axes
  std::array<std::int64_t, 3> pitch{0, 0, 0}; ///< pitch[0]: cells from row to row; pitch[1]: rows from plane to plane
  std::int64_t base = 0;
  std::int64_t cells = 0;                     ///< size of a field component: a multiple of `padding`
  std::int64_t reach = 0;                     ///< largest |shift|

  std::int64_t index(std::int64_t k0, std::int64_t k1, std::int64_t k2) const noexcept {
    return base + k0 + pitch[0] * (k1 + pitch[1] * k2);
  }
  std::array<std::int64_t, 3> cell(std::int64_t index) const noexcept;
  std::array<double, 3> position(std::int64_t index) const noexcept;
  std::int64_t shift(const std::array<int, 3>& offset) const noexcept {
    return offset[0] + pitch[0] * (offset[1] + pitch[1] * offset[2]);
  }
};

/// Cells along one axis: points at lower + (k + 1/2) spacing, up to upper.
std::int64_t lattice_cells(double lower, double upper, double spacing);

/// `horizon` limits the padding; offsets beyond the extent of the body never occur and need none.
Lattice make_lattice(int dimension, double spacing, const std::array<double, 3>& lower, const std::array<double, 3>& upper,
                     double horizon);

/// Integer offsets (internal axes) of the bonds of a whole family: |d| spacing <= horizon (1 + 1e-10), d != 0. The first half
/// holds one of each pair +d, -d; slot s + half is the reverse of slot s. Within a half axis 0 varies slowest.
std::vector<std::array<int, 3>> family_offsets(const Lattice& lattice, double horizon);

}  // namespace perikit
