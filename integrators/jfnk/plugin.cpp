#include "../shared/bond_jacobian.hpp"
#include "jfnk.hpp"
#include "perikit/integrator.hpp"

PERIKIT_PLUGIN(registrar) {
  using namespace perikit;
  ParameterTable table = load_step_parameters(25);
  table.choice("tangent", {"exact", "differences"}, "Tangent actions: exact directional derivatives, or central differences of forces.").by_default("\"exact\"");
  add_preconditioner_key(table, true);
  table.integer("restart", "Krylov vectors before GMRES restarts; each costs one field.").by_default("60").at_least(2).at_most(1000);
  table.integer("max_restarts", "Restarts of GMRES before a linear solve ends.").by_default("20").at_least(0).at_most(10000);
  table.boolean("line_search", "Halve steps that are inadmissible or do not lead on.").by_default("true");
  add_bond_jacobian_key(table);
  registrar.integrator(
      {.name = "jfnk",
       .summary = "quasi-static Newton-Krylov without a matrix",
       .parameters = std::move(table),
       .examples = {"steps = 10\ntolerance = 1.0e-8", "tangent = \"differences\"\npreconditioner = \"jacobi\""},
       .equations = "K(u) du = r(u) by restarted GMRES on K w; |r| <= tolerance sqrt(|loads|^2 + |reactions|^2)\n"
                    "differences: K w = -(f(u + eps w) - f(u - eps w))/(2 eps), eps = eps_mach^(1/3) spacing/|w|_inf",
       .source = "Partmann et al., eqs. 3.69-3.81; forcing terms: Eisenstat and Walker 1996",
       .limits = "Follows paths that the load parameter can follow: no snap-through."},
      [](const ParameterValues& values, const PartFactory&) {
        JfnkOptions options;
        options.krylov.differences = values.text("tangent") == "differences";
        options.krylov.preconditioner = values.text("preconditioner");
        options.krylov.restart = static_cast<int>(values.integer("restart"));
        options.krylov.max_restarts = static_cast<int>(values.integer("max_restarts"));
        options.values = values;
        return std::make_unique<Jfnk>(options);
      });
}
