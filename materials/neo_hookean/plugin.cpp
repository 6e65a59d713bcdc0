#include "perikit/material.hpp"

#include <memory>

#include "law.hpp"
#include "perikit/sdk/law_material.hpp"

namespace perikit {

template class LawMaterial<NeoHookean>;

}  // namespace perikit

using namespace perikit;

PERIKIT_PLUGIN(registrar) {
  registrar.material(
      {.name = "neo_hookean",
       .summary = "compressible neo-Hookean rubber",
       .parameters = rubber_parameters(),
       .examples = {"density = 1000.0\nshear_modulus = 0.8\nbulk_modulus = 80.0",
                    "density = 1000.0\nyoungs_modulus = 1.0e6\npoisson_ratio = 0.49\nvolumetric = \"logarithmic\""},
       .equations = "psi = mu/2 (J^(-2/3) tr(C) - 3) + psi_vol(kappa, J)\n"
                    "P = mu J^(-2/3) (F - tr(C)/3 F^-T) + J psi_vol'(J) F^-T\n"
                    "psi_vol: quadratic kappa/2 (J - 1)^2, logarithmic kappa/2 (ln J)^2",
       .source = "Scabbia et al., eq. 5",
       .limits = "quadratic volumetric part: resists strong compression (J -> 0) with finite energy"},
      [](const ParameterValues& values, const PartFactory&) {
        const Volumetric form = values.text("volumetric") == "logarithmic" ? Volumetric::logarithmic : Volumetric::quadratic;
        return std::make_unique<LawMaterial<NeoHookean>>(NeoHookean{form});
      });
}
