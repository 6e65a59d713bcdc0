#pragma once
/// What evaluations of forces leave behind for those who look for failing bonds by their energy: points with a bond that may hold too much.
/// All others need no look.

#include <atomic>
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
  std::vector<std::uint8_t> near;  ///< by group of eight points: bit l: point l of it has one
  AlignedVector<double> u;         ///< the displacement that `near` belongs to
  bool known = false;              ///< near is of this u

  /// From any thread.
  void mark(std::size_t p) noexcept {
    std::atomic_ref(near[p / padding]).fetch_or(static_cast<std::uint8_t>(1u << p % padding), std::memory_order_relaxed);
  }
};

}  // namespace perikit
