#include <memory>

#include "perikit/core/simd.hpp"
#include "perikit/sdk/plugin.hpp"

using namespace perikit;

namespace {

/// Gradient of the owner, with its part along the bond replaced by the bond's own deformation.
class Projection final : public Kinematics {
 public:
  explicit Projection(BondWeight weight) : weight_(weight) {}

  KinematicsTraits traits() const noexcept override {
    return {.at = EvaluationPoints::bonds, .base = BondBase::own, .weight = weight_, .g_from_xi_only = true};
  }

  void correction(const FamilyView& family, double* g, std::size_t stride) const noexcept override {
    for (int k = 0; k < family.bonds; k += pack_width) {
      const Pack length = Pack::load(family.length + k), scale = 1.0 / (length * length);
      for (int c = 0; c < family.dimension; ++c) (Pack::load(family.xi[c] + k) * scale).store(g + c * stride + k);
    }
  }

 private:
  BondWeight weight_;
};

PartDescription description() {
  PartDescription part{.name = "projection",
                       .summary = "gradient of the point, exact along each bond; no zero-energy modes",
                       .parameters = {},
                       .examples = {"", "weight = \"kernel\""},
                       .equations = "F_ij = F_i (I - n (x) n) + y_ij (x) xi/|xi|^2,  n = xi/|xi|\n"
                                    "W_ij = V_i V_j / sum_j V_j  (weight = \"volume\"),  V_i omega V_j / sum_j omega V_j  (\"kernel\")",
                       .source = "Breitzman and Dayal, J. Mech. Phys. Solids 110 (2018) 192-204; "
                                 "Hu et al., A unified framework of bond-associated correspondence models, eqs. 8-9, 31",
                       .limits = "two material evaluations per pair, one from each end; `baqp` needs one"};
  part.parameters.choice("weight", {"volume", "kernel"}, "share of a bond in its point's volume: by V or by omega V").by_default("\"volume\"");
  return part;
}

}  // namespace

PERIKIT_PLUGIN(registrar) {
  registrar.kinematics(description(), [](const ParameterValues& values, const PartFactory&) {
    return std::make_unique<Projection>(values.text("weight") == "kernel" ? BondWeight::kernel : BondWeight::volume);
  });
}
