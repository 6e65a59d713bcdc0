#include "perikit/sdk/stable_step.hpp"
#include "verlet.hpp"

PERIKIT_PLUGIN(registrar) {
  using namespace perikit;
  ParameterTable table;
  table.number("end_time", "s", "End of the run; hit exactly by equal steps.").require().positive();
  table.number("time_step", "s", "Largest step; found from the stiffness where it is not given.").positive();
  table.number("safety", "-", "Factor to the estimated stable step; without it 0.9, and 0.5 where bonds may fail.")
      .positive()
      .at_most(1.0);
  table
      .choice("estimate", {"eigenvalue", "bond_based"},
              "Stable step from the largest eigenvalue of the tangent, or from the bond-based formula where that is shorter.")
      .by_default("\"eigenvalue\"");
  table.integer("check_every", "Most steps between new estimates where the stiffness can grow; sooner where the body is stretched or bonds fail.")
      .by_default("500")
      .at_least(1);
  allow_unstable_parameter(table);
  table.at_most_of(1, {"time_step", "safety"});
  registrar.integrator(
      {.name = "verlet",
       .summary = "explicit velocity Verlet with an estimated stable step",
       .parameters = std::move(table),
       .examples = {"end_time = 1.0e-4", "end_time = 1.0e-4\ntime_step = 1.0e-6"},
       .equations = "v(t+dt/2) = v(t-dt/2) + dt a(t), u(t+dt) = u(t) + dt v(t+dt/2), a = (f_int + f_ext)/m\n"
                    "dt = safety 2/sqrt(lambda_max(M^-1 K)), K the exact tangent",
       .source = "Partmann et al., eqs. 3.60-3.68; bond-based estimate: eq. 3.58",
       .limits = "Needs densities. Prescribed velocities hold at half steps, prescribed displacements at full steps."},
      [](const ParameterValues& values, const PartFactory&) {
        VerletOptions options;
        options.end_time = values.number("end_time");
        if (values.has("time_step")) options.time_step = values.number("time_step");
        if (values.has("safety")) options.safety = values.number("safety");
        options.bond_based = values.text("estimate") == "bond_based";
        options.check_every = values.integer("check_every");
        options.values = values;
        return std::make_unique<Verlet>(options);
      });
}
