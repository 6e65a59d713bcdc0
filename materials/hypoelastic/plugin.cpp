#include "perikit/material.hpp"

#include <memory>

#include "law.hpp"
#include "perikit/sdk/law_material.hpp"

namespace perikit {

template class LawMaterial<Hypoelastic>;

}  // namespace perikit

using namespace perikit;

PERIKIT_PLUGIN(registrar) {
  registrar.material(
      {.name = "hypoelastic",
       .summary = "rate law: unrotated stress rate linear in the unrotated rate of deformation",
       .parameters = elastic_parameters(),
       .examples = {"density = 1000.0\nyoungs_modulus = 1.0e6\npoisson_ratio = 0.25"},
       .equations = "sigma = R s R^T,  ds/dt = lambda tr(d) I + 2 mu d,  d = R^T sym(dF/dt F^-1) R = sym(dU/dt U^-1),  F = R U\n"
                    "P = J sigma F^-T",
       .source = "Partmann et al., eqs. 4.45-4.57, after Flanagan and Taylor",
       .limits = "The stress depends on the path: results depend on the steps, to second order. `evaluate` takes the displacement as one increment."},
      [](const ParameterValues&, const PartFactory&) { return std::make_unique<LawMaterial<Hypoelastic>>(); });
}
