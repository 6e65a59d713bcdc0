#include "perikit/material.hpp"

#include <memory>

#include "law.hpp"
#include "perikit/sdk/law_material.hpp"

namespace perikit {

template class LawMaterial<LinearElastic>;

}  // namespace perikit

using namespace perikit;

PERIKIT_PLUGIN(registrar) {
  registrar.material({.name = "linear_elastic",
                      .summary = "small-strain isotropic elasticity",
                      .parameters = elastic_parameters(),
                      .examples = {"density = 1000.0\nyoungs_modulus = 1.0e6\npoisson_ratio = 0.25"},
                      .equations = "psi = lambda/2 (tr e)^2 + mu e:e,  e = (H + H^T)/2\n"
                                   "P = lambda tr(e) I + 2 mu e",
                      .source = "Chowdhury et al., eq. 5; Partmann et al., eq. 2.36",
                      .limits = "for small strains and rotations: not objective by definition; beyond them saint_venant_kirchhoff and hencky take the same constants"},
                     [](const ParameterValues&, const PartFactory&) { return std::make_unique<LawMaterial<LinearElastic>>(); });
}
