#include "newton.hpp"

#include <fmt/format.h>

#include "perikit/core/field_operations.hpp"

namespace perikit {

bool FactorisedEquations::linearise(Equilibrium& equilibrium, ConstFieldView u, std::string& failure) {
  Problem& problem = equilibrium.problem();
  u_ = u;
  if (problem.constant_stiffness() && solver_.factorised()) return true;
  const EvaluationStatus status = problem.assemble_tangent(u, tangent_);
  if (!status.ok()) {
    failure = status.description.empty() ? "the tangent met an inadmissible deformation" : status.description;
    return false;
  }
  const bool first = solver_.unknowns() == 0;
  if (!solver_.factorise(tangent_, equilibrium.free(), failure)) return false;
  if (first) {
    equilibrium.note(fmt::format("  tangent: {} unknowns, {:.3g} numbers, {:.3g} in its factors", solver_.unknowns(), static_cast<double>(tangent_.values.size()), solver_.factor_entries()));
  }
  return true;
}

bool FactorisedEquations::apply(Equilibrium& equilibrium, ConstFieldView w, FieldView Kw, std::string& failure) {
  if (equilibrium.tangent(u_, w, Kw)) return true;
  failure = equilibrium.failure();
  return false;
}

bool FactorisedEquations::solve(Equilibrium&, ConstFieldView rhs, double, FieldView du, std::string& note, std::string&) {
  solver_.solve(rhs, du);
  // Past a bifurcation or a limit point equilibria are unstable: worth knowing, and no reason to stop.
  if (tangent_.symmetric && !solver_.positive_definite()) note += "  tangent not positive definite";
  return true;
}

void Newton::run(Problem& problem, Observer& observer) {
  FactorisedEquations equations;
  NewtonIteration newton(equations, options_.load_steps.max_iterations, options_.line_search);
  run_load_steps("newton", options_.load_steps, problem, observer, newton);
}

}  // namespace perikit
