#include "perikit/damage.hpp"

#include <algorithm>
#include <cmath>

using namespace perikit;

namespace {

/// Largest eigenvalue of the symmetric tensor xx yy zz xy xz yz: m + 2 r cos(arccos(q)/3), m the mean, r the size and q the third
/// invariant of the deviator.
double largest_principal(const double (&s)[6]) noexcept {
  const double m = (s[0] + s[1] + s[2]) / 3, x = s[0] - m, y = s[1] - m, z = s[2] - m;
  const double square = (x * x + y * y + z * z) / 6 + (s[3] * s[3] + s[4] * s[4] + s[5] * s[5]) / 3, r = std::sqrt(square);
  if (!(r > 0)) return m;
  const double determinant = x * (y * z - s[5] * s[5]) - s[3] * (s[3] * z - s[5] * s[4]) + s[4] * (s[3] * s[5] - y * s[4]);
  const double q = std::clamp(determinant / (2 * r * square), -1.0, 1.0);
  return m + 2 * r * std::cos(std::acos(q) / 3);
}

class MaxStress final : public Damage {
 public:
  explicit MaxStress(double strength) : strength_(strength) {}

  DamageTraits traits() const noexcept override { return {.bits = true, .stress = true}; }
  DamageLimits limits(const DamagePoint&) const override { return {strength_, strength_}; }

  void measure(const BondStates& b) const noexcept override {
    for (int k = 0; k < b.n; ++k) {
      double sigma[6];
      for (std::size_t c = 0; c < 6; ++c) sigma[c] = b.stress[c * b.stride + static_cast<std::size_t>(k)];
      b.value[k] = b.stretch[k] > 0 ? largest_principal(sigma) : 0.0;
    }
  }

  void integrity(const IntegrityBatch& b) const noexcept override {
    for (int k = 0; k < b.n; ++k) b.integrity[k] = b.value[k] > b.failure[k] ? 0.0 : 1.0;
  }

 private:
  double strength_;
};

PartDescription description() {
  PartDescription part{
      .name = "max_stress",
      .summary = "a bond breaks for good once the largest principal stress exceeds a strength",
      .parameters = {},
      .examples = {"strength = 0.05"},
      .equations =
          "b = 0 once sigma_1 > strength and s > 0,  sigma_1 the largest principal Cauchy stress of the bond's evaluation points",
      .source = "Rankine's criterion, at bonds",
      .limits = "not of pair laws, which have no stress; what a crack costs per area depends on the horizon"};
  part.parameters.number("strength", "Pa", "Largest principal Cauchy stress that a bond bears.").require().positive();
  return part;
}

}  // namespace

PERIKIT_PLUGIN(registrar) {
  registrar.damage(description(), [](const ParameterValues& values, const PartFactory&) {
    return std::make_unique<MaxStress>(values.number("strength"));
  });
}
