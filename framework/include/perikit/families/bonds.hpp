#pragma once
/// Bonds that fail during a run: how they are named, and what a problem is told of them.

#include <compare>
#include <cstdint>
#include <functional>
#include <memory>

#include "perikit/core/field.hpp"
#include "perikit/model/damage.hpp"

namespace perikit {

/// The damage criterion of a body with its limits by point (infinite where points must not fail). A bond has the mean of its ends.
struct BodyDamage {
  std::shared_ptr<const Damage> law;
  Field onset, failure;           ///< [-]; failure is empty where it equals onset everywhere
  Field crack_speed;              ///< by point [m/s], where bonds let go in the course of several steps; else empty

  const Field& last() const noexcept { return failure.size() > 0 ? failure : onset; }
  bool gradual() const noexcept { return crack_speed.size() > 0; }
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

/// motion(end): end <- the displacement until which bonds that fail now still act. Called where any fail; empty: they act no longer.
using Motion = std::function<void(FieldView)>;

struct BondUpdate {
  std::size_t changed = 0;          ///< bonds, each once
  double released = 0;              ///< strain energy that they held: before less after, at the same displacement [J]
  double dissipated = 0;            ///< the same at the displacement where they cease to act [J]
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
