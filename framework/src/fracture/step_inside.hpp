#pragma once
/// The explicit step inside of which bonds fail.

#include <functional>

#include "perikit/core/field.hpp"

namespace perikit {

/// The explicit step that ended now. Empty: bonds fail where they were found.
struct StepInside {
  /// u <- the displacement at the beginning of the step.
  std::function<void(FieldView u)> begin;
  /// The forces [N] of bonds that failed at this moment of the step, from 0 at its beginning to 1 at its end, act so much longer [s], then and there: velocities
  /// change, and displacements by what that has done since. `force` is overwritten. Returns how fast the power of these forces would have grown without the bonds [W/s].
  std::function<double(FieldView force, double time, double moment)> act;
  explicit operator bool() const noexcept { return begin != nullptr; }
};

}  // namespace perikit
