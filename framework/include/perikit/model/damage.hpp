#pragma once
/// Damage criteria: the integrity b of a bond, 1 intact and 0 broken, as a falling function of its stretch s = (|y| - |xi|)/|xi|.
///
/// A criterion is only that function. The engine makes it irreversible and symmetric: b_ij is the least value that the bond has had, the
/// same for ij and ji, and it changes between steps (or converged load steps), never inside an evaluation, so that force = -dE/du holds.

#include <cstddef>

#include "perikit/model/family_point.hpp"

namespace perikit {

struct DamageTraits {
  bool bits = true;        ///< b is 1 or 0, never between: a bond needs one bit
};

/// What the limits of a point's bonds may depend on.
struct DamagePoint : FamilyPoint {
  double mean_length = 0;  ///< <xi> = int omega xi^d / int omega xi^(d-1) over (0, delta), d the dimension [m]
};

/// b is 1 up to `onset` and 0 beyond `failure`; equal where bonds break at once. A bond takes the mean of its two ends; points that
/// must not fail have infinite limits.
struct StretchLimits {
  double onset = 0, failure = 0;
};

/// Arrays over n bonds that can be read and written up to padded(n).
struct IntegrityBatch {
  int n = 0;
  const double* stretch = nullptr;   ///< s [-]
  const double* onset = nullptr;     ///< limits of the bond
  const double* failure = nullptr;
  double* integrity = nullptr;       ///< b in [0, 1], fully overwritten
};

class Damage {
 public:
  virtual ~Damage() = default;
  virtual DamageTraits traits() const noexcept = 0;
  /// Limits at one point, 0 < onset <= failure; asked at set-up. Throws std::domain_error naming what is wrong.
  virtual StretchLimits limits(const DamagePoint&) const = 0;
  /// Never rises with s; 1 for s <= onset, 0 for s > failure. Infinite limits never break.
  virtual void integrity(const IntegrityBatch&) const noexcept = 0;
};

}  // namespace perikit
