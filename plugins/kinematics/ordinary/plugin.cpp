#include <memory>

#include "perikit/core/simd.hpp"
#include "perikit/kinematics.hpp"

using namespace perikit;

namespace {

/// phi = k theta^2/2.
class VolumeSpring final : public DilatationLaw {
 public:
  void evaluate(const DilatationBatch& b) const noexcept override {
    for (int k = 0; k < b.n; k += pack_width) {
      const Pack stiffness = Pack::load(b.modulus + k), theta = Pack::load(b.theta + k), pressure = stiffness * theta;
      if (b.energy) (0.5 * pressure * theta).store(b.energy + k);
      if (b.pressure) pressure.store(b.pressure + k);
      if (b.stiffness) stiffness.store(b.stiffness + k);
    }
  }
};

/// The linear peridynamic solid. Its energy density, with e_dev = e - theta |xi|/d and sum omega e_dev^2 V =
/// sum omega e^2 V - m theta^2/d^2, is that of springs a mu omega/m and a volumetric term:
///   K theta^2/2 + (a mu/(2m)) sum omega e_dev^2 V = (K - a mu/d^2) theta^2/2 + (a mu/(2m)) sum omega e^2 V,  a = 15 (3D), 8 (2D)
class Ordinary final : public PairKinematics {
 public:
  explicit Ordinary(BondFactorsOf factors) : factors_(factors) {}

  PairTraits traits() const noexcept override { return {.factors = factors_}; }

  PairModuli moduli(const PairPoint& x) const noexcept override {
    const int d = dimension(x.space);
    // A line has no shape to keep: springs alone.
    const double shear = d == 3 ? 15 * x.moduli.mu : d == 2 ? 8 * x.moduli.mu : x.bulk();
    // Broken bonds weaken both terms; the springs of a pair count half from each end.
    return {2 * x.intact * shear / x.weighted_volume, d == 1 ? 0.0 : x.intact * (x.bulk() - shear / (d * d))};
  }

  std::string warning(const PairPoint&) const override { return {}; }

  void bond_law(const BondBatch& b) const noexcept override {
    for (int k = 0; k < b.n; k += pack_width) {
      const Pack stiffness = Pack::load(b.modulus + k) * Pack::load(b.omega + k), e = Pack::load(b.extension + k), force = stiffness * e;
      if (b.energy) (0.5 * force * e).store(b.energy + k);
      if (b.force) force.store(b.force + k);
      if (b.stiffness) stiffness.store(b.stiffness + k);
    }
  }

  const DilatationLaw* dilatation() const noexcept override { return &volume_; }

 private:
  BondFactorsOf factors_;
  VolumeSpring volume_;
};

BondFactorsOf bond_factors(const std::string& name) {
  return name == "moments" ? BondFactorsOf::moments : name == "energy" ? BondFactorsOf::energy : BondFactorsOf::none;
}

PartDescription description() {
  PartDescription part{.name = "ordinary",
                       .summary = "linear peridynamic solid: central forces with a dilatation, two elastic constants; no zero-energy modes",
                       .parameters = {},
                       .examples = {"surface_correction = \"none\"", "surface_correction = \"energy\""},
                       .equations = "e = |y| - |xi|,  m_i = sum_j omega |xi|^2 V_j,  theta_i = (d/m_i) sum_j omega |xi| e V_j\n"
                                    "t = omega [3 K theta |xi| + 15 mu (e - theta |xi|/3)]/m  (3D)\n"
                                    "t = omega [2 k' theta |xi| + 8 mu (e - theta |xi|/2)]/m  (2D),  t = E omega e/m  (1D)",
                       .source = "Silling et al., J. Elasticity 88 (2007) 151; Partmann et al., GAMM-Mitteilungen 49 (2026) e70014, eqs. 3.14-3.20",
                       .limits = "of the material only its small strain counts; near surfaces a stretch along one axis is stored with errors of some per cent"};
  part.parameters.choice("surface_correction", {"none", "energy", "moments"},
                         "factors on the bonds. \"none\": sums over bonds as they are, as in the papers; \"energy\": of bonds near surfaces, so that a homogeneous stretch along an axis stores as much as inside; "
                         "\"moments\": of all bonds, so that uniform strains have the energy of the material, inside and near surfaces, and are in equilibrium inside of clouds")
      .by_default("\"moments\"");
  return part;
}

}  // namespace

PERIKIT_PLUGIN(registrar) {
  registrar.kinematics(description(), [](const ParameterValues& values, const PartFactory&) {
    return std::make_unique<Ordinary>(bond_factors(values.text("surface_correction")));
  });
}
