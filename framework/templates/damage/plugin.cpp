#include "perikit/damage.hpp"

#include <algorithm>
#include <memory>

using namespace perikit;

namespace {

/// YOUR PHYSICS: the integrity b of a bond as a function of its stretch, 1 up to the onset, 0 beyond failure, never rising.
/// The engine keeps the least b of every bond, in both directions. A criterion by energy or stress says so in its traits and
/// makes its value of them in `measure`, which is compared with the limits in place of the stretch (perikit/model/damage.hpp).
class PartName final : public Damage {
 public:
  PartName(double onset, double failure) : limits_{onset, failure} {}

  /// bits = true where b is only ever 1 or 0: a bond then needs one bit, and lattices keep their fast kernels.
  DamageTraits traits() const noexcept override { return {.bits = false}; }

  /// May depend on the material and the family of the point: x.moduli, x.bulk(), x.horizon, x.mean_length, x.crossing.
  DamageLimits limits(const DamagePoint&) const override { return limits_; }

  /// Default: a straight line from 1 to 0.
  void integrity(const IntegrityBatch& b) const noexcept override {
    for (int k = 0; k < b.n; ++k) {
      const double s = b.value[k], share = (b.failure[k] - s) / (b.failure[k] - b.onset[k]);
      b.integrity[k] = s <= b.onset[k] ? 1.0 : std::clamp(share, 0.0, 1.0);
    }
  }

 private:
  DamageLimits limits_;
};

ParameterTable parameters() {
  ParameterTable table;
  table.number("onset", "-", "Stretch where bonds begin to weaken.").by_default("0.01").positive();
  table.number("failure", "-", "Stretch where nothing is left, above onset.").by_default("0.02").positive();
  return table;
}

}  // namespace

PERIKIT_PLUGIN(registrar) {
  registrar.damage({.name = "part_name",
                    .summary = "one line: what it is",
                    .parameters = parameters(),
                    // Every example is built and tested by the contract suite.
                    .examples = {"", "onset = 0.05\nfailure = 0.1"},
                    .equations = "b = (failure - s)/(failure - onset)",
                    .source = "the paper, with the number of the equation",
                    .limits = "where it must not be used"},
                   [](const ParameterValues& values, const PartFactory&) {
                     const double onset = values.number("onset"), failure = values.number("failure");
                     if (onset >= failure) throw values.error("onset", "must be below `failure`");
                     return std::make_unique<PartName>(onset, failure);
                   });
}
