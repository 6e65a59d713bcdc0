#include <memory>

#include "perikit/core/simd.hpp"
#include "perikit/sdk/plugin.hpp"

using namespace perikit;

namespace {

/// Mean gradient of both ends, corrected along the bond: the same for ij and ji.
class BondQuadraturePoint final : public Kinematics {
 public:
  explicit BondQuadraturePoint(BondWeight weight) : weight_(weight) {}

  KinematicsTraits traits() const noexcept override {
    return {.at = EvaluationPoints::bonds, .base = BondBase::mean, .weight = weight_, .pair_symmetric = true, .g_from_xi_only = true};
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
  PartDescription part{.name = "baqp",
                       .summary = "bond-associated quadrature points: mean gradient of both ends, exact along the bond; no zero-energy modes",
                       .parameters = {},
                       .examples = {"", "weight = \"volume\""},
                       .equations = "F_ij = Fa + (y_ij - Fa xi) (x) xi/|xi|^2,  Fa = (F_i + F_j)/2\n"
                                    "W_ij = V_i omega V_j / sum_j omega V_j  (weight = \"kernel\"),  V_i V_j / sum_j V_j  (\"volume\")",
                       .source = "Partmann et al., GAMM-Mitteilungen 49 (2026) e70014, eqs. 4.21-4.33",
                       .limits = "one material evaluation per pair: about 3 times the work of `conventional`"};
  part.parameters.choice("weight", {"kernel", "volume"}, "share of a bond in its point's volume: by omega V or by V").by_default("\"kernel\"");
  return part;
}

}  // namespace

PERIKIT_PLUGIN(registrar) {
  registrar.kinematics(description(), [](const ParameterValues& values, const PartFactory&) {
    return std::make_unique<BondQuadraturePoint>(values.text("weight") == "kernel" ? BondWeight::kernel : BondWeight::volume);
  });
}
