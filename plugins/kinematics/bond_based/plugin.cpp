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
  explicit BondBased(BondFactorsOf factors) : factors_(factors) {}

  PairTraits traits() const noexcept override {
    return {.influence = false, .constant_moduli = true, .factors = factors_};
  }

  PairModuli moduli(const PairPoint& x) const noexcept override { return {x.micromodulus(), 0}; }

  /// One modulus fixes Poisson's ratio.
  std::string warning(const PairPoint& x) const override {
    const int d = dimension(x.space);
    const double nu = x.moduli.poisson(), fixed = x.space == Space::plane_stress ? 1.0 / 3 : 1.0 / 4;
    if (d == 1 || std::abs(nu - fixed) <= 1e-6) return {};
    return fmt::format("bond_based has Poisson's ratio {} in this body; the material's {:.6g} is not represented (its bulk modulus is); \"ordinary\" has any Poisson's ratio",
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
  BondFactorsOf factors_;
};

BondFactorsOf bond_factors(const std::string& name) {
  return name == "moments" ? BondFactorsOf::moments : name == "energy" ? BondFactorsOf::energy : BondFactorsOf::none;
}

PartDescription description() {
  PartDescription part{.name = "bond_based",
                       .summary = "pairwise springs, one elastic constant; no gradients, no zero-energy modes",
                       .parameters = {},
                       .examples = {"surface_correction = \"none\"", "surface_correction = \"energy\""},
                       .equations = "E = sum over pairs of c s^2 |xi| V_i V_j/2,  s = (|y| - |xi|)/|xi|,  c = (c_i + c_j)/2\n"
                                    "c = 18 K/(pi delta^4) (3D), 12 k'/(pi h delta^3) (2D), 2 E/(A delta^2) (1D)",
                       .source = "Silling, Askari, Computers & Structures 83 (2005) 1526; Partmann et al., GAMM-Mitteilungen 49 (2026) e70014, eqs. 3.8-3.11",
                       .limits = "Poisson's ratio is 1/4 (3D, plane strain) or 1/3 (plane stress); of the material only its small strain counts; "
                                 "the influence function has no effect"};
  part.parameters.choice("surface_correction", {"none", "energy", "moments"},
                         "factors on the bonds. \"none\": sums over bonds as they are, as in the papers; \"energy\": of bonds near surfaces, so that a homogeneous stretch along an axis stores as much as inside; "
                         "\"moments\": of all bonds, so that uniform strains have the energy of the material, inside and near surfaces, and are in equilibrium inside of clouds")
      .by_default("\"moments\"");
  return part;
}

}  // namespace

PERIKIT_PLUGIN(registrar) {
  registrar.kinematics(description(), [](const ParameterValues& values, const PartFactory&) {
    return std::make_unique<BondBased>(bond_factors(values.text("surface_correction")));
  });
}
