#pragma once
#include <span>

namespace perikit {

/// Influence function omega(r), r = |xi| / delta in (0, 1]. Results never depend on a constant factor.
class InfluenceFunction {
 public:
  virtual ~InfluenceFunction() = default;
  /// omega [any unit], same length as r, fully overwritten, >= 0 and finite for r in (0, 1].
  virtual void evaluate(std::span<const double> r, std::span<double> omega) const = 0;
};

}  // namespace perikit
