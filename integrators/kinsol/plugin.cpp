#include "kinsol.hpp"
#include "perikit/integrator.hpp"

PERIKIT_PLUGIN(registrar) {
  using namespace perikit;
  ParameterTable table = load_step_parameters(200);
  table.choice("strategy", {"none", "linesearch", "picard", "fixed_point"}, "Newton without or with line search, Picard iteration, or fixed-point iteration with Anderson acceleration.")
      .by_default("\"linesearch\"");
  table.choice("linear_solver", {"spgmr", "spfgmr", "spbcgs", "sptfqmr", "klu"}, "Krylov solvers on tangent actions, or KLU on the assembled tangent; fixed_point has none.").by_default("\"spgmr\"");
  add_preconditioner_key(table);
  table.integer("restart", "Krylov vectors before spgmr and spfgmr restart.").by_default("60").at_least(2).at_most(1000);
  table.integer("max_restarts", "Restarts of a linear solve.").by_default("20").at_least(0).at_most(10000);
  table.integer("anderson", "Steps that Anderson acceleration remembers (picard, fixed_point).").by_default("10").at_least(0).at_most(100);
  registrar.integrator(
      {.name = "kinsol",
       .summary = "quasi-static equilibrium by SUNDIALS' KINSOL",
       .parameters = std::move(table),
       .examples = {"steps = 10\ntolerance = 1.0e-8", "strategy = \"none\"\nlinear_solver = \"klu\"", "strategy = \"picard\"\npreconditioner = \"none\"",
                    "strategy = \"fixed_point\"\nmax_iterations = 5000"},
       .equations = "r(u) = 0; fixed_point: u <- u + r/m, m = lambda_max(K)/2; picard: u <- u + K(u0)^-1 r, u0 the start of the step\n"
                    "|r| <= tolerance sqrt(|loads|^2 + |reactions|^2)",
       .source = "Hindmarsh et al., SUNDIALS, 2005; Anderson 1965",
       .limits = "fixed_point converges slowly where the tangent is ill-conditioned."},
      [](const ParameterValues& values, const PartFactory&) {
        KinsolOptions options;
        options.load_steps = load_step_options(values);
        options.strategy = values.text("strategy");
        options.linear_solver = values.text("linear_solver");
        options.preconditioner = values.text("preconditioner");
        options.restart = static_cast<int>(values.integer("restart"));
        options.max_restarts = static_cast<int>(values.integer("max_restarts"));
        options.anderson = values.integer("anderson");
        return std::make_unique<Kinsol>(options);
      });
}
