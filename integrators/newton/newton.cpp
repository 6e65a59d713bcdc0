#include "newton.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "../shared/solver_memory.hpp"
#include "perikit/core/field_operations.hpp"
#include "perikit/core/memory.hpp"
#include "perikit/core/warnings.hpp"

namespace perikit {

bool FactorisedEquations::linearise(Equilibrium& equilibrium, ConstFieldView u, std::string& failure) {
  u_ = u;
  const SparseSolver& factors = tangent_.factors();
  if (equilibrium.problem().constant_stiffness() && factors.factorised()) return true;
  const bool first = factors.unknowns() == 0;
  in_step_ = true;
  if (!tangent_.make(equilibrium, equilibrium.at(u), true, failure)) return false;
  if (first) {
    equilibrium.note(fmt::format("  tangent: {} unknowns, {:.3g} numbers, {:.3g} in its factors", factors.unknowns(),
                                 static_cast<double>(tangent_.matrix().values.size()), factors.factor_entries()));
  }
  return true;
}

bool FactorisedEquations::apply(Equilibrium& equilibrium, ConstFieldView w, FieldView Kw, std::string& failure) {
  if (equilibrium.tangent(u_, w, Kw)) return true;
  failure = equilibrium.failure();
  return false;
}

bool FactorisedEquations::solve(Equilibrium& equilibrium, ConstFieldView rhs, double, FieldView du, std::string& note, std::string&) {
  tangent_.solve(rhs, du);
  // Past a bifurcation or a limit point equilibria are unstable: worth knowing, and no reason to stop.
  if (tangent_.convex())
    note += "  tangent made convex";
  else if (tangent_.matrix().symmetric && !tangent_.factors().positive_definite())
    note += "  tangent not positive definite";
  if (const double condition = tangent_.factors().reciprocal_condition(); condition < nearly_singular) {
    note += fmt::format("  tangent nearly singular ({:.1g})", condition);
    if (!std::exchange(warned_, true))
      equilibrium.note(named("singular", "warning: newton: the tangent is nearly singular: some part of the body is hardly held, and where it goes is rounding"));
  }
  return true;
}

bool FactorisedEquations::unstable(Equilibrium& equilibrium, ConstFieldView u, bool last) {
  if (equilibrium.problem().constant_stiffness()) return tangent_.indefinite();
  // The last tangent of the step is that of an iterate next to the equilibrium: where it is definite, so is that of the equilibrium. A step whose start was
  // in balance made none.
  const bool made = std::exchange(in_step_, false);
  std::string failure;
  if (made ? !tangent_.indefinite() : !last) return false;
  return tangent_.make(equilibrium, equilibrium.at(u), false, failure) && tangent_.indefinite();
}

bool Newton::direct(Problem& problem) const {
  const std::string& asked = values_.text("linear_solver");
  if (asked != "auto") return asked == "direct";
  if (problem.dimension() == 1) return true;
  // Measured (README.md): operations a second of CHOLMOD with its assembly, and what a linear solve with the companion takes, of which the number of
  // iterations grows with the root of the bulk modulus unless pressures are unknowns of their own.
  constexpr double operations_a_second = 1.6e10, seconds_a_point_2d = 1e-5, seconds_a_point_3d = 2.5e-5;
  const double bulk = mixed_pays(problem) ? 1 : std::sqrt(std::max(1.0, largest_bulk_ratio(problem) / 4));
  const double krylov = bulk * static_cast<double>(problem.points().size()) * (problem.dimension() == 2 ? seconds_a_point_2d : seconds_a_point_3d);
  return predict_factor(problem, static_cast<double>(problem.assembled_size().blocks)).operations <= operations_a_second * krylov &&
         direct_solver_bytes(problem) <= memory_limit();
}

std::string Newton::plan(Problem& problem) {
  bonds_of_jacobian(values_, problem);
  return {};
}

double Newton::memory(Problem& problem) {
  if (!direct(problem)) return krylov_solver_bytes(problem, "companion", KrylovOptions().restart);
  return problem.loads().follow() ? krylov_solver_bytes(problem, "factorisation", KrylovOptions().restart) : direct_solver_bytes(problem);
}

void Newton::run(Problem& problem, Observer& observer) {
  // The tangent of loads that follow the surface is not symmetric, and not in the assembled one: GMRES takes it in, with the factors of the rest.
  const bool follow = problem.loads().follow();
  if (!follow && direct(problem)) {
    FactorisedEquations equations;
    return run_newton("newton", values_, problem, observer, equations);
  }
  std::string chosen;
  KrylovOptions options;
  options.preconditioner = direct(problem) ? "factorisation" : mixed_pays(problem) ? "auto" : "companion";
  const std::unique_ptr<LinearisedProblem> equations = make_krylov_equations(problem, options, chosen);
  observer.log(fmt::format("newton: GMRES, preconditioner {}{}", chosen, follow ? ", with the tangent of the pressures that follow the surface" : ""));
  run_newton("newton", values_, problem, observer, *equations);
}

}  // namespace perikit
