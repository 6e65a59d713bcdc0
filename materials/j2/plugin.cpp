#include "perikit/material.hpp"

#include <memory>

#include "law.hpp"
#include "perikit/sdk/law_material.hpp"

namespace perikit {

template class LawMaterial<Plastic<J2>>;

static ParameterTable j2_parameters() {
  ParameterTable table = elastic_parameters();
  table.material("yield_stress", "Pa", "Yield stress at the start.").require().positive();
  table.material("hardening", "Pa", "Growth of the yield stress with the equivalent plastic strain; above -3 times the shear modulus.").by_default("0.0");
  table.material("saturation_stress", "Pa", "What the yield stress grows to, beside linear hardening. Without it: yield_stress.").positive();
  table.material("saturation_rate", "-", "How fast it grows to saturation_stress, over the equivalent plastic strain: a share of 1 - 1/e after 1/saturation_rate.").by_default("0.0").at_least(0);
  return table;
}

}  // namespace perikit

using namespace perikit;

PERIKIT_PLUGIN(registrar) {
  registrar.material(
      {.name = "j2",
       .summary = "plasticity of metals at finite strains: von Mises yield stress with linear and saturating isotropic hardening",
       .parameters = j2_parameters(),
       .examples = {"density = 7850.0\nyoungs_modulus = 210.0e9\npoisson_ratio = 0.3\nyield_stress = 0.24e9\nhardening = 1.0e9",
                    "density = 7850.0\nbulk_modulus = 164.21e9\nshear_modulus = 80.1938e9\nyield_stress = 0.45e9\nsaturation_stress = 0.715e9\nsaturation_rate = 16.93\nhardening = 0.12924e9"},
       .equations = "F = F_e F_p,  b = F C_p^-1 F^T,  h = ln(b)/2,  tau = K ln(J) I + 2 mu dev h,  P = tau F^-T\n"
                    "q = sqrt(3/2) |dev tau| <= yield_stress + hardening a + (saturation_stress - yield_stress) (1 - exp(-saturation_rate a))\n"
                    "states: plastic_strain = (I - C_p^-1)/2, equivalent_plastic_strain = a",
       .source = "Simo (1992); de Souza Neto, Peric, Owen (2008), box 14.3",
       .limits = "The stress depends on the path. Isotropic hardening alone: no Bauschinger effect, no rates, no temperature. Softening (hardening < 0) has no length of its own: where strains gather depends on the horizon."},
      [](const ParameterValues&, const PartFactory&) { return std::make_unique<LawMaterial<Plastic<J2>>>(); });
}
