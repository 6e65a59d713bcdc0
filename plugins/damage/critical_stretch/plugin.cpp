#include "perikit/damage.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "perikit/core/simd.hpp"

using namespace perikit;

namespace {

/// Stretch at which the bonds across a plane have taken up Gc [J/m^2] under a homogeneous expansion psi = (bulk modulus) (d s)^2/2:
///   Gc = psi <xi>/2 (3D),   2 psi <xi>/pi (2D),   psi <xi> (1D),   <xi> = int omega xi^d / int omega xi^(d-1)
double stretch_of(double energy_release_rate, const DamagePoint& x, double mean_length) {
  const double bulk = x.bulk();
  switch (dimension(x.space)) {
    case 3: return std::sqrt(4 * energy_release_rate / (9 * bulk * mean_length));
    case 2: return std::sqrt(std::numbers::pi * energy_release_rate / (4 * bulk * mean_length));
    default: return std::sqrt(2 * energy_release_rate / (bulk * mean_length));
  }
}

class CriticalStretch final : public Damage {
 public:
  CriticalStretch(double energy_release_rate, double stretch, bool consistent)
      : energy_release_rate_(energy_release_rate), stretch_(stretch), consistent_(consistent) {}

  DamageTraits traits() const noexcept override { return {.bits = true}; }

  DamageLimits limits(const DamagePoint& x) const override {
    if (energy_release_rate_ <= 0) return {stretch_, stretch_};
    // Bonds whose energy grows with their length (bond_based) are those of omega = xi: 4/5, 3/4, 2/3 of the horizon.
    const double d = dimension(x.space), of_integral = consistent_ ? x.mean_length : (d + 1) / (d + 2) * x.horizon;
    const double mean_length = x.counted_length > 0 ? x.counted_length : of_integral;
    const double s = stretch_of(energy_release_rate_, x, mean_length);
    if (!(s > 0) || !std::isfinite(s))
      throw std::domain_error(
          fmt::format("found energy_release_rate = {}, which gives a critical stretch of {} with this material and influence "
                      "function; allowed: one that gives a finite stretch > 0",
                      energy_release_rate_, s));
    return {s, s};
  }

  void integrity(const IntegrityBatch& b) const noexcept override {
    for (int k = 0; k < b.n; k += pack_width) {
      select(Pack::load(b.value + k) > Pack::load(b.failure + k), Pack(0.0), Pack(1.0)).store(b.integrity + k);
    }
  }

 private:
  double energy_release_rate_, stretch_;   ///< one of them is 0
  bool consistent_;
};

PartDescription description() {
  PartDescription part{
      .name = "critical_stretch",
      .summary = "a bond breaks for good once it is stretched beyond a limit",
      .parameters = {},
      .examples = {"stretch = 0.1", "energy_release_rate = 0.05", "energy_release_rate = 0.05\nconsistent = true"},
      .equations =
          "b = 0 once s > s_c,  s = (|y| - |xi|)/|xi|\n"
          "s_c = sqrt(5 Gc/(9 K delta)) (3D),  sqrt(pi Gc/(3 k' delta)) (2D),  sqrt(3 Gc/(E delta)) (1D)\n"
          "consistent: sqrt(4 Gc/(9 K <xi>)), sqrt(pi Gc/(4 k' <xi>)), sqrt(2 Gc/(E <xi>))",
      .source =
          "Silling, Askari, Computers & Structures 83 (2005) 1526; Partmann et al., GAMM-Mitteilungen 49 (2026) e70014, eqs. "
          "5.6-5.8",
      .limits = "bonds in compression never break; a bond across two materials fails where it holds as much as bonds of either at their limit"};
  part.parameters.number("energy_release_rate", "J/m^2", "Gc: energy that a new crack takes per area.").positive();
  part.parameters.number("stretch", "-", "Critical stretch s_c itself.").positive();
  part.parameters.boolean("consistent", "With energy_release_rate: for bonds whose energy is shared out by the influence function (correspondence models).")
      .by_default("false");
  part.parameters.exactly(1, {"energy_release_rate", "stretch"});
  return part;
}

}  // namespace

PERIKIT_PLUGIN(registrar) {
  registrar.damage(description(), [](const ParameterValues& values, const PartFactory&) {
    const bool by_energy = values.has("energy_release_rate");
    const bool consistent = values.boolean("consistent");
    if (consistent && !by_energy) throw values.error("consistent", "found true with `stretch`; allowed: only with energy_release_rate");
    return std::make_unique<CriticalStretch>(by_energy ? values.number("energy_release_rate") : 0.0, by_energy ? 0.0 : values.number("stretch"), consistent);
  });
}
