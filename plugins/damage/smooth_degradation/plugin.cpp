#include "perikit/damage.hpp"

#include <fmt/format.h>

#include <cmath>

#include "perikit/core/simd.hpp"

using namespace perikit;

namespace {

class SmoothDegradation final : public Damage {
 public:
  SmoothDegradation(double onset, double failure, double beta) : limits_{onset, failure}, beta_(beta), top_(std::tanh(beta)) {}

  DamageTraits traits() const noexcept override { return {.bits = false}; }
  DamageLimits limits(const DamagePoint&) const override { return limits_; }

  void integrity(const IntegrityBatch& b) const noexcept override {
    for (int k = 0; k < b.n; ++k) {
      const double s = b.value[k], onset = b.onset[k], failure = b.failure[k];
      // H 48 with T_s(s_cr) taken off and scaled to 1 at s_min: no jump at either end.
      const double n = beta_ * (2 * s - onset - failure) / (failure - onset);
      b.integrity[k] = s <= onset ? 1.0 : s >= failure ? 0.0 : std::min(1.0, std::max(0.0, (top_ - std::tanh(n)) / (2 * top_)));
    }
  }

 private:
  DamageLimits limits_;
  double beta_, top_;
};

PartDescription description() {
  PartDescription part{.name = "smooth_degradation",
                       .summary = "bonds weaken between two stretches, without a jump at either",
                       .parameters = {},
                       .examples = {"stretch_min = 0.05\nstretch = 0.15", "stretch_min = 0.05\nstretch = 0.15\nbeta = 1.0"},
                       .equations =
                           "T(s) = (1 - tanh n)/2,  n = beta (2 s - s_min - s_cr)/(s_cr - s_min)\n"
                           "b = (T(s) - T(s_cr))/(T(s_min) - T(s_cr)), s the largest stretch so far",
                       .source = "Hashim et al., eq. 48, rescaled to be continuous",
                       .limits = "in groups of eight lattice points with a weakened bond, every bond has a number of its own"};
  part.parameters.number("stretch_min", "-", "Stretch where bonds begin to weaken.").require().positive();
  part.parameters.number("stretch", "-", "Stretch where nothing is left, above stretch_min.").require().positive();
  part.parameters.number("beta", "-", "Steepness in the middle of the range.").by_default("3.0").positive().at_most(100.0);
  return part;
}

}  // namespace

PERIKIT_PLUGIN(registrar) {
  registrar.damage(description(), [](const ParameterValues& values, const PartFactory&) {
    const double onset = values.number("stretch_min"), failure = values.number("stretch");
    if (onset >= failure) throw values.error("stretch_min", fmt::format("found {}; allowed: below stretch = {}", onset, failure));
    return std::make_unique<SmoothDegradation>(onset, failure, values.number("beta"));
  });
}
