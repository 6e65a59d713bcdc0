#include "perikit/material.hpp"

#include <memory>

#include "law.hpp"
#include "perikit/sdk/law_material.hpp"

namespace perikit {

template class LawMaterial<MooneyRivlin>;

static ParameterTable mooney_rivlin_parameters() {
  ParameterTable table;
  table.material("density", "kg/m^3", "mass per reference volume").require().positive();
  table.material("C1", "Pa", "factor of the first invariant").require();
  table.material("C2", "Pa", "factor of the second invariant; C1 + C2 is half the shear modulus").require();
  table.material("bulk_modulus", "Pa", "bulk modulus kappa").require().positive();
  table.choice("volumetric", {"quadratic", "logarithmic"}, "kappa/2 (J - 1)^2 or kappa/2 (ln J)^2").by_default("\"quadratic\"");
  return table;
}

}  // namespace perikit

using namespace perikit;

PERIKIT_PLUGIN(registrar) {
  registrar.material(
      {.name = "mooney_rivlin",
       .summary = "compressible Mooney-Rivlin rubber",
       .parameters = mooney_rivlin_parameters(),
       .examples = {"density = 1000.0\nC1 = 0.3\nC2 = 0.1\nbulk_modulus = 80.0"},
       .equations = "psi = C1 (J^(-2/3) I1 - 3) + C2 (J^(-4/3) I2 - 3) + psi_vol(kappa, J),  I1, I2 invariants of C = F^T F\n"
                    "P = tau F^-T,  tau = 2 C1 J^(-2/3) d + 2 C2 J^(-4/3) ((1 + m) d - dev d^2) + J psi_vol'(J) I\n"
                    "b = F F^T, 1 + m = tr(b)/3, d = dev b\n"
                    "psi_vol: quadratic kappa/2 (J - 1)^2, logarithmic kappa/2 (ln J)^2",
       .source = "Scabbia et al., eqs. 3-7",
       .limits = "C1 + C2 > 0 (half the shear modulus); C2 < 0 loses stability at large stretches"},
      [](const ParameterValues& values, const PartFactory&) {
        const Volumetric form = values.text("volumetric") == "logarithmic" ? Volumetric::logarithmic : Volumetric::quadratic;
        return std::make_unique<LawMaterial<MooneyRivlin>>(MooneyRivlin{form});
      });
}
