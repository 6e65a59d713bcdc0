#pragma once
/// Bonds that fail during a run: what a model is told, and what it answers.

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

  const Field& last() const noexcept { return failure.size() > 0 ? failure : onset; }
};

/// A bond whose integrity fell, named once for both directions.
struct BondChange {
  std::int32_t point = 0, far = 0;  ///< internal indices
  std::int64_t bond = 0;            ///< lattices: slot at `point`; clouds: index into the lists
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
