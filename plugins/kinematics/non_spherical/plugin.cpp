#include <cmath>
#include <memory>

#include "perikit/core/field.hpp"
#include "perikit/core/simd_math.hpp"
#include "perikit/kinematics.hpp"
#include "perikit/sdk/kinematics_options.hpp"

using namespace perikit;

namespace {

/// Each bond's own family: bonds of like length and direction count most.
class NonSpherical final : public WeightedKinematics {
 public:
  NonSpherical(double n1, double n2, BondWeight weight) : n1_(n1), n2_(n2), weight_(weight) {}

  WeightedTraits traits() const noexcept override { return {.weight = weight_}; }
  int parts(int /*dimension*/) const override { return 0; }

  void weights(const FamilyView& family, double* omega, std::size_t stride) const noexcept override {
    if (n2_ == 0.0) return weights(family, omega, stride, [](Pack) { return Pack(1.0); });
    if (n2_ == 1.0) return weights(family, omega, stride, [](Pack likeness) { return likeness; });
    if (n2_ == 2.0) return weights(family, omega, stride, [](Pack likeness) { return likeness * likeness; });
    // x^n = exp(n log x); log 0 = -infinity gives 0
    weights(family, omega, stride, [n = Pack(n2_)](Pack likeness) { return exp(n * log(likeness)); });
  }

 private:
  /// omega_q(k) = exp(-n1 | |xi_k| - |xi_q| | / delta) power((1 + cos(xi_k, xi_q)) / 2), 0 for broken bonds and in the padding.
  /// One exponential per bond, not one per pair of bonds: exp(-|a - b|) = min(e^a / e^b, e^b / e^a).
  template <class Power>
  void weights(const FamilyView& family, double* omega, std::size_t stride, const Power& power) const noexcept {
    thread_local AlignedVector<double> memory;
    const std::size_t size = padded(static_cast<std::size_t>(family.bonds));
    memory.resize(5 * size);
    double *growth = memory.data(), *decay = growth + size, *direction[3] = {decay + size, decay + 2 * size, decay + 3 * size};
    for (int k = 0; k < family.bonds; k += pack_width) {
      const Pack length = Pack::load(family.length + k), scale = std::sqrt(0.5) / length;
      const Pack rate = Pack(n1_) * (length / Pack(family.horizon) - 0.5);  // centred: far from the ends of the range of double
      exp(rate).store(growth + k);
      exp(-rate).store(decay + k);
      for (int e = 0; e < family.dimension; ++e) (scale * Pack::load(family.xi[e] + k)).store(direction[e] + k);
    }
    for (int q = 0; q < family.bonds; ++q, omega += stride) {
      for (int k = 0; k < family.bonds; k += pack_width) {
        Pack likeness(0.5);
        for (int e = 0; e < family.dimension; ++e) likeness += Pack(direction[e][q]) * Pack::load(direction[e] + k);
        const Pack near = min(Pack(growth[q]) * Pack::load(decay + k), Pack(decay[q]) * Pack::load(growth + k));
        // rounding may leave opposite bonds slightly below 0
        const Pack value = near * power(max(likeness, Pack(0.0)));
        select(Pack::load(family.omega + k) == Pack(0.0), Pack(0.0), value).store(omega + k);
      }
    }
  }

  double n1_, n2_;
  BondWeight weight_;
};

PartDescription description() {
  PartDescription part{
      .name = "non_spherical",
      .summary = "a family of its own for every bond, in which bonds of like length and direction count most",
      .parameters = {},
      .examples = {"", "n1 = 0.0\nn2 = 2.0"},
      .equations =
          "F_q = (sum_k omega_q(k) V_k y_k (x) xi_k) (sum_k omega_q(k) V_k xi_k (x) xi_k)^-1\n"
          "omega_q(k) = exp(-n1 | |xi_k| - |xi_q| | / delta) (1/2 + 1/2 cos(angle))^n2\n"
          "W_q = V_i V_j / sum_j V_j  (weight = \"volume\"),  V_i omega V_j / sum_j omega V_j  (\"kernel\")",
      .source =
          "Chen, Hu and Chan, Comput. Methods Appl. Mech. Eng. 429 (2024) 117137; "
          "Hu et al., A unified framework of bond-associated correspondence models, eqs. 18-19",
      .limits =
          "the influence function of [family] only says which bonds are alive (and weighs them with \"kernel\"); "
          "work grows with the square of the family; n1 = n2 = 0 has the zero-energy modes of `conventional`"};
  part.parameters.number("n1", "-", "how fast the influence falls with the difference in bond length")
      .by_default("1.0")
      .at_least(0.0)
      .at_most(1000.0);
  part.parameters.number("n2", "-", "how fast the influence falls with the angle between bonds").by_default("1.0").at_least(0.0);
  add_bond_weight(part.parameters, BondWeight::volume);
  return part;
}

}  // namespace

PERIKIT_PLUGIN(registrar) {
  registrar.kinematics(description(), [](const ParameterValues& values, const PartFactory&) {
    return std::make_unique<NonSpherical>(values.number("n1"), values.number("n2"),
                                          bond_weight(values));
  });
}
