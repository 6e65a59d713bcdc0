#include "perikit/kinematics.hpp"
#include "perikit/sdk/projected_bond.hpp"

using namespace perikit;

namespace {

PartDescription description() {
  PartDescription part{.name = "baqp",
                       .summary = "bond-associated quadrature points: mean gradient of both ends, exact along the bond; no zero-energy modes",
                       .parameters = {},
                       .examples = {"", "weight = \"volume\"", "order = 2"},
                       .equations = "F_ij = Fa + (y_ij - Fa xi) (x) xi/|xi|^2,  Fa = (F_i + F_j)/2,  F_i: point gradient of order n\n"
                                    "W_ij = V_i omega V_j / sum_j omega V_j  (weight = \"kernel\"),  V_i V_j / sum_j V_j  (\"volume\")",
                       .source = "Partmann et al., GAMM-Mitteilungen 49 (2026) e70014, eqs. 4.21-4.33; order n: 3.43-3.53",
                       .limits = "one material evaluation per pair: about 3 times the work of `conventional`"};
  add_projected_bond(part.parameters, BondWeight::kernel);
  return part;
}

}  // namespace

PERIKIT_PLUGIN(registrar) {
  registrar.kinematics(description(), [](const ParameterValues& values, const PartFactory&) { return make_projected_bond(BondBase::mean, values); });
}
