#include "newton.hpp"
#include "perikit/integrator.hpp"

PERIKIT_PLUGIN(registrar) {
  using namespace perikit;
  ParameterTable table = load_step_parameters(25);
  table.boolean("line_search", "Halve steps that are inadmissible or do not lead on.").by_default("true");
  table
      .choice("linear_solver", {"auto", "direct", "krylov"},
              "Linear systems: factors of the assembled tangent (direct), or GMRES with the companion of jfnk (krylov); auto: the one that is predicted to be faster.")
      .by_default("\"auto\"");
  add_bond_jacobian_key(table);
  registrar.integrator(
      {.name = "newton",
       .summary = "quasi-static Newton's method with the exact tangent, by a sparse direct solver or GMRES",
       .parameters = std::move(table),
       .examples = {"steps = 10\ntolerance = 1.0e-10"},
       .equations = "K(u) du = r(u) - K(u) w, w the missing part of prescribed displacements\n"
                    "|r| <= tolerance sqrt(|loads|^2 + |reactions|^2)",
       .source = "Hashim et al., eqs. 21-29; factorisations: CHOLMOD and UMFPACK (SuiteSparse); GMRES: SUNDIALS",
       .limits = "Factors grow with the coupling of two to three horizons; large bodies are solved by GMRES. Follows paths that the load parameter can follow: "
                 "no snap-through."},
      [](const ParameterValues& values, const PartFactory&) {
        return std::make_unique<Newton>(values);
      });
}
