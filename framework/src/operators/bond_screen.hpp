#pragma once
/// What evaluations of forces leave behind for those who look for failing bonds by their energy: groups of eight points with a
/// bond that may hold too much. All other groups need no look.

#include <cstdint>
#include <vector>

#include "perikit/core/field.hpp"

namespace perikit {

struct BondScreen {
  /// By point: no bond fails where no evaluation point of the point and of what it is evaluated with holds more energy per volume
  /// [J/m^3]. Infinite where bonds must not fail. Of pair laws 0 elsewhere.
  AlignedVector<double> density;
  /// Of pair laws: the least limit of the energy of a bond over its share, or of its energy.
  double limit = 0;
  bool over_share = true;
  std::vector<std::uint8_t> near;  ///< by group of eight points
  AlignedVector<double> u;         ///< the displacement that `near` belongs to
  bool known = false;              ///< near is of this u
};

}  // namespace perikit
