#include <fmt/format.h>

#include <cmath>
#include <memory>

#include "perikit/core/simd.hpp"
#include "perikit/kinematics.hpp"

using namespace perikit;

namespace {

/// Springs: w = c e^2/(2 |xi|), the prototype microelastic law.
class BondBased final : public PairKinematics {
 public:
  explicit BondBased(bool surface_correction) : surface_correction_(surface_correction) {}

  PairTraits traits() const noexcept override {
    return {.influence = false, .constant_moduli = true, .surface_correction = surface_correction_};
  }

  PairModuli moduli(const PairPoint& x) const noexcept override { return {x.micromodulus(), 0}; }

  /// One modulus fixes Poisson's ratio.
  std::string warning(const PairPoint& x) const override {
    const int d = dimension(x.space);
    const double nu = x.moduli.poisson(), fixed = x.space == Space::plane_stress ? 1.0 / 3 : 1.0 / 4;
    if (d == 1 || std::abs(nu - fixed) <= 1e-6) return {};
    return fmt::format("bond_based has Poisson's ratio {} in this body; the material's {:.6g} is not represented (its bulk modulus is)",
                       d == 2 && fixed > 0.3 ? "1/3" : "1/4", nu);
  }

  void bond_law(const BondBatch& b) const noexcept override {
    for (int k = 0; k < b.n; k += pack_width) {
      const Pack stiffness = Pack::load(b.modulus + k) * b.inverse_lengths(k), e = Pack::load(b.extension + k), force = stiffness * e;
      if (b.energy) (0.5 * force * e).store(b.energy + k);
      if (b.force) force.store(b.force + k);
      if (b.stiffness) stiffness.store(b.stiffness + k);
    }
  }

  const DilatationLaw* dilatation() const noexcept override { return nullptr; }

 private:
  bool surface_correction_;
};

PartDescription description() {
  PartDescription part{.name = "bond_based",
                       .summary = "pairwise springs, one elastic constant; no gradients, no zero-energy modes",
                       .parameters = {},
                       .examples = {"", "surface_correction = \"energy\""},
                       .equations = "E = sum over pairs of c s^2 |xi| V_i V_j/2,  s = (|y| - |xi|)/|xi|,  c = (c_i + c_j)/2\n"
                                    "c = 18 K/(pi delta^4) (3D), 12 k'/(pi h delta^3) (2D), 2 E/(A delta^2) (1D)",
                       .source = "Silling, Askari, Computers & Structures 83 (2005) 1526; Partmann et al., GAMM-Mitteilungen 49 (2026) e70014, eqs. 3.8-3.11",
                       .limits = "Poisson's ratio is 1/4 (3D, plane strain) or 1/3 (plane stress); of the material only its small strain counts; "
                                 "the influence function has no effect"};
  part.parameters.choice("surface_correction", {"none", "energy"}, "\"energy\": bonds of cut families are stiffened, so that a homogeneous stretch along an axis stores as much as inside")
      .by_default("\"none\"");
  return part;
}

}  // namespace

PERIKIT_PLUGIN(registrar) {
  registrar.kinematics(description(), [](const ParameterValues& values, const PartFactory&) {
    return std::make_unique<BondBased>(values.text("surface_correction") == "energy");
  });
}
