#pragma once
/// Which bonds of a body may fail, and where their limits are.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "perikit/core/field.hpp"
#include "perikit/model/damage.hpp"

namespace perikit {

class BondCopies;

/// Bonds between two sides of a body that have limits of their own.
struct InterfaceDamage {
  std::array<std::uint16_t, 2> sides{};
  std::array<DamageLimits, 2> limits;  ///< with the material of either side
  double least() const noexcept { return std::min(limits[0].onset, limits[1].onset); }
};

/// The damage criterion of a body with its limits by point (infinite where points must not fail).
struct BodyDamage {
  std::shared_ptr<const Damage> law;
  Field onset, failure;             ///< of the criterion's value; failure is empty where it equals onset everywhere
  Field crack_speed;                ///< by point [m/s], where bonds let go in the course of several steps; else empty
  std::vector<std::uint16_t> side;  ///< by point, where bonds between regions have other limits than their weaker end; else empty
  std::vector<InterfaceDamage> interfaces;
  /// By point, from the nearest interface of two materials, where bonds across it are springs in series [m]; infinite elsewhere. Empty where limits
  /// are no stretches, or there is one region.
  Field distance;
  /// Of a body with images; else null. By energy and by stress copies fail together; by stretch each fails by its own, but for those of fragments.
  std::shared_ptr<const BondCopies> copies;
  bool second_law = false;  ///< bonds whose failure would raise the stored energy stay as they are

  const Field& last() const noexcept { return failure.size() > 0 ? failure : onset; }
  /// Of the limits of all bonds of these points.
  double least_onset(std::span<const std::int32_t> points) const noexcept {
    double least = std::numeric_limits<double>::infinity();
    for (const std::int32_t p : points) least = std::min(least, onset.data()[p]);
    for (const InterfaceDamage& i : interfaces) least = std::min(least, i.least());
    return least;
  }
  bool gradual() const noexcept { return crack_speed.size() > 0; }
  bool by_stretch() const noexcept { return !law->traits().energy && !law->traits().stress; }
  /// Whether the bond between two points lies between regions.
  bool between_sides(std::size_t p, std::size_t q) const noexcept { return !side.empty() && side[p] != side[q]; }
  /// Of the bond between two points: the limits of its weaker end. Between regions a limit of stretch stands for an energy, so that the stiffness
  /// of the bond counts: see `stretch_across`.
  DamageLimits limits(std::size_t p, std::size_t q) const noexcept {
    constexpr double infinite = std::numeric_limits<double>::infinity();
    const double *first = onset.data(), *end = last().data();
    if (std::max(first[p], first[q]) == infinite) return {infinite, infinite};
    DamageLimits a{first[p], end[p]}, b{first[q], end[q]};
    if (between_sides(p, q)) {
      for (const InterfaceDamage& i : interfaces) {
        const std::size_t of_p = i.sides[0] == side[p] ? 0 : 1;
        if (i.sides[of_p] != side[p] || i.sides[1 - of_p] != side[q]) continue;
        a = i.limits[of_p];
        b = i.limits[1 - of_p];
        break;
      }
      if (distance.size() > 0) return {stretch_across(a.onset, b.onset, p, q), stretch_across(a.failure, b.failure, p, q)};
    }
    return {std::min(a.onset, b.onset), std::min(a.failure, b.failure)};
  }

 private:
  /// Stretch at which a bond across two materials holds what a bond of either one holds at its own limit, c_i s_i^2 = c_j s_j^2. Of springs in
  /// series 1/c = (l_i/c_i + l_j/c_j)/(l_i + l_j), l_i and l_j the distances of its ends from the interface; else c = (c_i + c_j)/2.
  double stretch_across(double of_p, double of_q, std::size_t p, std::size_t q) const noexcept {
    if (of_p == of_q) return of_p;
    double l_p = distance.data()[p], l_q = distance.data()[q];
    if (std::isinf(l_p + l_q)) return std::sqrt(2 / (1 / (of_p * of_p) + 1 / (of_q * of_q)));
    if (l_p + l_q == 0) l_p = l_q = 1;
    return std::sqrt((l_p * of_p * of_p + l_q * of_q * of_q) / (l_p + l_q));
  }
};

}  // namespace perikit
