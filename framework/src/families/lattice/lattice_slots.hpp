#pragma once
/// The bonds of a whole family on a lattice: one list of offsets for all points. A bond of a point is named by its slot in this list.

#include <array>
#include <cstdint>
#include <vector>

#include "perikit/body/influence.hpp"
#include "perikit/body/lattice.hpp"

namespace perikit {

/// Rows of offsets (d1, d2) with |d0| <= reach and their weights by |d0|: the first of each mirrored pair.
struct RowPair {
  std::int64_t shift;
  int d1, d2, reach;
  int profile;                                 ///< rows with the same d1^2 + d2^2 share their weights
};

struct RowProfile {
  int reach;
  std::vector<double> omega;                   ///< by |d0|, 0 ... reach
  std::vector<double> omega_d0;                ///< omega times |d0|
};

struct LatticeSlots {
  /// influence null: omega is 1.
  LatticeSlots(const Lattice& lattice, double horizon, const InfluenceFunction* influence);

  std::vector<std::array<int, 3>> offsets;     ///< internal axes [cells]; the second half mirrors the first
  std::vector<std::int64_t> shifts;            ///< of the far end in memory; positive in the first half
  std::vector<std::array<double, 3>> xi;       ///< bond vectors, input axes [m]
  std::vector<double> omega;
  std::vector<std::uint16_t> ascending;        ///< slots in the order of their shifts
  std::size_t half = 0;                        ///< slots of one of each pair
  std::vector<RowPair> row_pairs;              ///< without the row (0, 0)
  std::vector<RowProfile> profiles;
  int own_row = -1;                            ///< profile of the row (0, 0); -1: no bond lies in it
  int row_reach = 0;                           ///< largest |d0|

  std::size_t size() const noexcept { return offsets.size(); }
  std::size_t reverse(std::size_t slot) const noexcept { return slot < half ? slot + half : slot - half; }
  /// The slot with this shift, which is one.
  std::size_t with_shift(std::int64_t shift) const noexcept;

 private:
  void collect_rows(const Lattice& lattice);
};

}  // namespace perikit
