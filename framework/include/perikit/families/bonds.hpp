#pragma once
/// Bonds that fail during a run: how they are named, and what a problem is told of them.

#include <algorithm>
#include <compare>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <vector>

#include "perikit/core/field.hpp"
#include "perikit/model/damage.hpp"

namespace perikit {

/// Bonds between two sides of a body that have limits of their own.
struct InterfaceDamage {
  std::uint16_t a = 0, b = 0;  ///< sides
  DamageLimits limits;
};

/// The damage criterion of a body with its limits by point (infinite where points must not fail). A bond has those of its weaker
/// end.
struct BodyDamage {
  std::shared_ptr<const Damage> law;
  Field onset, failure;             ///< of the criterion's value; failure is empty where it equals onset everywhere
  Field crack_speed;                ///< by point [m/s], where bonds let go in the course of several steps; else empty
  std::vector<std::uint16_t> side;  ///< by point, for interfaces; empty without
  std::vector<InterfaceDamage> interfaces;
  bool second_law = false;  ///< bonds whose failure would raise the stored energy stay as they are

  const Field& last() const noexcept { return failure.size() > 0 ? failure : onset; }
  bool gradual() const noexcept { return crack_speed.size() > 0; }
  bool by_stretch() const noexcept { return !law->traits().energy && !law->traits().stress; }
  /// Of the bond between two points.
  DamageLimits limits(std::size_t p, std::size_t q) const noexcept {
    constexpr double infinite = std::numeric_limits<double>::infinity();
    const double *first = onset.data(), *end = last().data();
    if (std::max(first[p], first[q]) == infinite) return {infinite, infinite};
    if (!side.empty() && side[p] != side[q])
      for (const InterfaceDamage& i : interfaces)
        if ((i.a == side[p] && i.b == side[q]) || (i.a == side[q] && i.b == side[p])) return i.limits;
    return {std::min(first[p], first[q]), std::min(end[p], end[q])};
  }
};

/// A bond is named by its ends, internal indices with point < far: one name for both directions, on lattices and clouds.
struct BondId {
  std::int32_t point = 0, far = 0;
  static BondId of(std::int32_t p, std::int32_t q) noexcept { return p < q ? BondId{p, q} : BondId{q, p}; }
  friend auto operator<=>(const BondId&, const BondId&) = default;
};

/// A bond whose integrity fell.
struct BondChange {
  BondId bond;
  double integrity = 0;
};

/// The same as all ranks name it: by the places of its ends in the whole body.
struct NamedBond {
  std::int64_t point = 0, far = 0;
  friend auto operator<=>(const NamedBond&, const NamedBond&) = default;
};
struct NamedChange {
  NamedBond bond;
  double integrity = 0;
  friend bool operator<(const NamedChange& a, const NamedChange& b) { return a.bond < b.bond; }
};

/// What a bond has of the stored energy.
struct BondEnergy {
  BondId bond;
  double energy = 0;  ///< [J]
};

/// before(u): u <- the displacement at the beginning of the explicit step that ended now. Called where bonds fail; empty: they
/// fail where they were found.
using StepBegin = std::function<void(FieldView)>;

/// What bonds that failed inside of a step mean for it. Its forces were taken with them.
struct BondReaction {
  Field impulse;  ///< what they still owed when they failed, or had given too much [N s]
  Field drift;    ///< that of the first half of the step times its length: by mass, what it has moved the points [N s^2]
};

struct BondUpdate {
  std::size_t changed = 0;  ///< bonds, each once
  double dissipated = 0;    ///< strain energy before less after, at the displacement where they failed [J]
  std::vector<std::int32_t> ends = {};  ///< points whose bonds have changed, some of them more than once
  std::size_t held = 0;     ///< bonds that stay as they are, as their failure would have raised the energy
  int inside_out = 0;       ///< times that a point was inadmissible where bonds failed: no energy and no impulse is taken of them
};

/// How the checks went: what the conservative skip saved.
struct BondChecks {
  std::size_t updates = 0;          ///< calls of update_bonds
  std::size_t groups = 0;           ///< groups of eight points that could have been checked, summed over updates
  std::size_t checked = 0;          ///< groups that were
  std::size_t failed = 0;           ///< bonds broken by now, each once
  std::size_t weakened = 0;         ///< bonds between whole and broken
};

}  // namespace perikit
