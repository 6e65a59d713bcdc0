#include <memory>

#include "perikit/core/simd.hpp"
#include "perikit/kinematics.hpp"
#include "perikit/sdk/kinematics_options.hpp"

using namespace perikit;

namespace {

/// Each bond's own domain: the part of the family that is near the bond's far end.
class BondAssociated final : public WeightedKinematics {
 public:
  BondAssociated(double ratio, BondWeight weight, ForceState force_state) : ratio_(ratio), weight_(weight), force_state_(force_state) {}

  WeightedTraits traits() const noexcept override { return {.weight = weight_, .force_state = force_state_}; }
  int parts(int /*dimension*/) const override { return 0; }

  /// omega where |xi_k - xi_q| <= bond horizon, else 0. Lattice points on the sphere count, whatever the rounding.
  void weights(const FamilyView& family, double* omega, std::size_t stride) const noexcept override {
    const double radius = ratio_ * family.horizon * (1 + 1e-10);
    const Pack reach(radius * radius);
    for (int q = 0; q < family.bonds; ++q, omega += stride) {
      for (int k = 0; k < family.bonds; k += pack_width) {
        Pack square(0.0);
        for (int a = 0; a < family.dimension; ++a) {
          const Pack difference = Pack::load(family.xi[a] + k) - Pack(family.xi[a][q]);
          square += difference * difference;
        }
        select(square <= reach, Pack::load(family.omega + k), Pack(0.0)).store(omega + k);
      }
    }
  }

 private:
  double ratio_;
  BondWeight weight_;
  ForceState force_state_;
};

PartDescription description() {
  PartDescription part{.name = "bond_associated",
                       .summary = "a gradient for each bond from the part of the family that is near the bond's far end",
                       .parameters = {},
                       .examples = {"", "bond_horizon_ratio = 1.2\nweight = \"kernel\"", "force_state = \"local\""},
                       .equations = "F_ij = (sum_k omega V_k y_ik (x) xi_ik) (sum_k omega V_k xi_ik (x) xi_ik)^-1,  k in H_i with |X_k - X_j| <= r delta\n"
                                    "W_ij = V_i V_j / sum_j V_j  (weight = \"volume\"),  V_i omega V_j / sum_j omega V_j  (\"kernel\")\n"
                                    "force_state = \"local\": T_ij = (sum of V over the domain / sum of V over H_i) omega P_ij K_ij^-1 xi_ij; not conservative",
                       .source = "Chen, Bond-associated deformation gradients for peridynamic correspondence model, Mech. Res. Commun. 90 (2018) 34-41; "
                                 "Partmann et al., GAMM-Mitteilungen 49 (2026) e70014, eqs. 4.15-4.20; "
                                 "Scabbia et al. 2025, eqs. 12-14",
                       .limits = "work grows with the square of the family; domains without a gradient of their own (all of them with the "
                                 "nearest neighbours only) use the whole family"};
  part.parameters.number("bond_horizon_ratio", "-", "radius r of the ball around the far end, to the horizon").by_default("1.0").positive();
  add_bond_weight(part.parameters, BondWeight::volume);
  add_force_state(part.parameters);
  return part;
}

}  // namespace

PERIKIT_PLUGIN(registrar) {
  registrar.kinematics(description(), [](const ParameterValues& values, const PartFactory&) {
    return std::make_unique<BondAssociated>(values.number("bond_horizon_ratio"), bond_weight(values), force_state(values));
  });
}
