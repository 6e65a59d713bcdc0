#pragma once
/// What evaluations of forces leave behind for those who look for failing bonds by their energy: points with a bond that may hold too much, or the
/// bonds themselves. All others need no look.

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <vector>

#include "families/bonds.hpp"
#include "perikit/core/field.hpp"
#include "perikit/core/parallel.hpp"

namespace perikit {

struct BondScreen {
  /// By point: no bond fails where no evaluation point of the point and of what it is evaluated with holds more energy per volume
  /// [J/m^3]. Infinite where bonds must not fail. Of pair laws 0 elsewhere.
  AlignedVector<double> density;
  /// By point, where evaluation points belong to bonds: no bond fails where neither of its two evaluation points holds more than that of its owner
  /// [J/m^3]. Infinite where bonds must not fail. Empty: points are marked.
  AlignedVector<double> of_bonds;
  bool with_factors = false;  ///< what they hold counts with their factors (EvaluationSpace::set_factors)
  /// Of pair laws: the least limit of the energy of a bond over its share, or of its energy.
  double limit = 0;
  bool over_share = true;
  std::vector<std::uint8_t> near;  ///< by group of eight points: bit l: point l of it has one
  std::vector<std::vector<BondId>> bonds;  ///< by thread: those whose evaluation points hold that much, some of them twice
  AlignedVector<double> u;         ///< the displacement that `near` belongs to
  bool known = false;              ///< near is of this u

  /// Before and after an evaluation of forces of the whole body, which marks.
  void begin() {
    known = false;
    std::ranges::fill(near, std::uint8_t{0});
    bonds.resize(static_cast<std::size_t>(thread_count()));
    for (auto& of_thread : bonds) of_thread.clear();
  }
  void end(ConstFieldView at) {
    u.assign(at.data, at.data + at.size());
    known = true;
  }
  /// Whether the last one that ended was at these displacements.
  bool known_at(ConstFieldView at) const noexcept { return known && std::equal(at.data, at.data + at.size(), u.begin()); }
  /// From any thread.
  void mark(std::size_t p) noexcept {
    std::atomic_ref(near[p / padding]).fetch_or(static_cast<std::uint8_t>(1u << p % padding), std::memory_order_relaxed);
  }
  bool by_bond() const noexcept { return !of_bonds.empty(); }
  /// From any thread: a bond whose evaluation points hold so much. far_psi: of the far end; 0 where it comes by itself.
  void look(std::int32_t p, std::int32_t far, double psi, double far_psi) {
    const double own = of_bonds[static_cast<std::size_t>(p)], other = of_bonds[static_cast<std::size_t>(far)];
    if (p != far && (psi > own || far_psi > other) && std::isfinite(std::max(own, other)))
      bonds[static_cast<std::size_t>(thread_index())].push_back(BondId::of(p, far));
  }
};

}  // namespace perikit
