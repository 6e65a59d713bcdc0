#include "newton.hpp"
#include "perikit/sdk/plugin.hpp"

PERIKIT_PLUGIN(registrar) {
  using namespace perikit;
  ParameterTable table = load_step_parameters(25);
  table.boolean("line_search", "Halve steps that are inadmissible or do not lead on.").by_default("true");
  add_bond_jacobian_key(table);
  registrar.integrator(
      {.name = "newton",
       .summary = "quasi-static Newton's method with the assembled tangent and a sparse direct solver",
       .parameters = std::move(table),
       .examples = {"steps = 10\ntolerance = 1.0e-10"},
       .equations = "K(u) du = r(u) - K(u) w, w the missing part of prescribed displacements\n"
                    "|r| <= tolerance sqrt(|loads|^2 + |reactions|^2)",
       .source = "Hashim et al., eqs. 21-29; factorisations: CHOLMOD and UMFPACK (SuiteSparse)",
       .limits = "Memory grows with the coupling of two to three horizons: 2D, and 3D with small families. Follows paths that the load parameter can follow: "
                 "no snap-through."},
      [](const ParameterValues& values, const PartFactory&) {
        return std::make_unique<Newton>(values);
      });
}
