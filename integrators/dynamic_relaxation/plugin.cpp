#include "dynamic_relaxation.hpp"
#include "perikit/integrator.hpp"

PERIKIT_PLUGIN(registrar) {
  using namespace perikit;
  ParameterTable table = load_step_parameters(200000);
  table.choice("damping", {"adaptive", "kinetic"}, "Viscous damping, critical for a Rayleigh quotient of the motion, or rest at every peak of the kinetic energy.")
      .by_default("\"adaptive\"");
  registrar.integrator(
      {.name = "dynamic_relaxation",
       .summary = "quasi-static equilibrium by damped motion of fictitious masses",
       .parameters = std::move(table),
       .examples = {"steps = 10\ntolerance = 1.0e-6", "steps = 10\ndamping = \"kinetic\""},
       .equations = "v <- ((1 - c) v + r/m)/(1 + c), u <- u + v, m = 1.1 lambda_max(K)/4\n"
                    "c^2 = v.(r_last - r)/(m v.v); |r| <= tolerance sqrt(|loads|^2 + |reactions|^2)",
       .source = "Underwood 1983; compared with Newton's method in Hashim et al., Fig. 16",
       .limits = "The number of iterations grows with the square root of the condition of the tangent: slow for slender bodies and strong contrasts."},
      [](const ParameterValues& values, const PartFactory&) {
        return std::make_unique<DynamicRelaxation>(RelaxationOptions{load_step_options(values), values.text("damping") == "kinetic"});
      });
}
