#include "perikit/material.hpp"

#include <memory>

#include "law.hpp"
#include "perikit/sdk/law_material.hpp"

namespace perikit {

template class LawMaterial<SaintVenantKirchhoff>;

}  // namespace perikit

using namespace perikit;

PERIKIT_PLUGIN(registrar) {
  registrar.material(
      {.name = "saint_venant_kirchhoff",
       .summary = "second Piola-Kirchhoff stress linear in the Green-Lagrange strain",
       .parameters = elastic_parameters(),
       .examples = {"density = 1000.0\nyoungs_modulus = 1.0e6\npoisson_ratio = 0.25"},
       .equations = "psi = lambda/2 (tr E)^2 + mu E:E,  E = (F^T F - I)/2\n"
                    "S = lambda tr(E) I + 2 mu E,  P = F S",
       .source = "Partmann et al., section 2",
       .limits = "moderate strains: softens in strong compression (stretches below 0.58 uniaxially); in plane and uniaxial "
                 "stress there is no solution where E33 would fall below -1/2"},
      [](const ParameterValues&, const PartFactory&) { return std::make_unique<LawMaterial<SaintVenantKirchhoff>>(); });
}
