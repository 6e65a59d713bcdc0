#include "perikit/kinematics.hpp"
#include "perikit/sdk/projected_bond.hpp"

using namespace perikit;

namespace {

PartDescription description() {
  PartDescription part{.name = "projection",
                       .summary = "gradient of the point, exact along each bond; no zero-energy modes",
                       .parameters = {},
                       .examples = {"", "weight = \"kernel\"", "order = 2"},
                       .equations = "F_ij = F_i (I - n (x) n) + y_ij (x) xi/|xi|^2,  n = xi/|xi|,  F_i: point gradient of order n\n"
                                    "W_ij = V_i V_j / sum_j V_j  (weight = \"volume\"),  V_i omega V_j / sum_j omega V_j  (\"kernel\")",
                       .source = "Breitzman and Dayal, J. Mech. Phys. Solids 110 (2018) 192-204; "
                                 "Hu et al., A unified framework of bond-associated correspondence models, eqs. 8-9, 31",
                       .limits = "two material evaluations per pair, one from each end; `baqp` needs one"};
  add_projected_bond(part.parameters, BondWeight::volume);
  return part;
}

}  // namespace

PERIKIT_PLUGIN(registrar) {
  registrar.kinematics(description(), [](const ParameterValues& values, const PartFactory&) { return make_projected_bond(BondBase::own, values); });
}
