#include "perikit/material.hpp"

#include <memory>

#include "law.hpp"
#include "perikit/sdk/law_material.hpp"

namespace perikit {

template class LawMaterial<Hencky>;

}  // namespace perikit

using namespace perikit;

PERIKIT_PLUGIN(registrar) {
  registrar.material(
      {.name = "hencky",
       .summary = "Kirchhoff stress linear in the logarithmic strain",
       .parameters = elastic_parameters(),
       .examples = {"density = 1000.0\nyoungs_modulus = 1.0e6\npoisson_ratio = 0.25"},
       .equations = "psi = lambda/2 (ln J)^2 + mu h:h,  h = ln(F F^T)/2\n"
                    "tau = lambda ln(J) I + 2 mu h,  P = tau F^-T",
       .source = "Hashim et al., eqs. 4-8 and appendix A",
       .limits = "not elliptic at large stretches: the nominal stress of uniaxial tension has its maximum at a stretch of 2.718"},
      [](const ParameterValues&, const PartFactory&) { return std::make_unique<LawMaterial<Hencky>>(); });
}
