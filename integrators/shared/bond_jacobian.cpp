#include "bond_jacobian.hpp"

#include <fmt/format.h>
#include <sunlinsol/sunlinsol_spfgmr.h>

#include <string>

#include "perikit/core/field_operations.hpp"

namespace perikit {

namespace {

constexpr int most_vectors = 30;
constexpr double accuracy = 0.05;  // of a forecast
constexpr double of_K = 0.2;       // where systems with K are not solved exactly

}  // namespace

void add_bond_jacobian_key(ParameterTable& table) {
  table
      .boolean("bond_jacobian",
               "With a [damage] whose bonds weaken gradually: the Jacobian of the degrading bonds says how far they do, in place of forecasts from "
               "what they did last.")
      .by_default("false");
}

std::unique_ptr<WeakeningBonds> bonds_of_jacobian(const ParameterValues& values, Problem& problem) {
  if (!values.boolean("bond_jacobian")) return nullptr;
  if (std::unique_ptr<WeakeningBonds> bonds = problem.weakening_bonds()) return bonds;
  throw values.error("bond_jacobian", "found true; allowed here: false, as it needs a [damage] whose bonds weaken gradually, and one rank");
}

void run_newton(std::string_view integrator, const ParameterValues& values, Problem& problem, Observer& observer, LinearisedProblem& equations) {
  const LoadStepOptions options = load_step_options(values);
  NewtonIteration newton(equations, options.max_iterations, values.boolean("line_search"));
  std::unique_ptr<WeakeningBonds> bonds = bonds_of_jacobian(values, problem);
  if (!bonds) return run_load_steps(integrator, options, problem, observer, newton);
  BondJacobian jacobian(problem, newton, equations, std::move(bonds));
  run_load_steps(integrator, options, problem, observer, jacobian);
}

BondJacobian::BondJacobian(Problem& problem, NewtonIteration& newton, LinearisedProblem& equations, std::unique_ptr<WeakeningBonds> bonds)
    : newton_(newton),
      equations_(equations),
      bonds_(std::move(bonds)),
      u_(problem.make_field()),
      right_(problem.make_field()),
      du_(problem.make_field()),
      right_vector_(wrap(problem, right_, context_)),
      solution_(wrap(problem, du_, context_)) {
  gmres_.reset(SUNLinSol_SPFGMR(right_vector_.get(), SUN_PREC_RIGHT, most_vectors, context_));
  if (!gmres_) throw RunError("SUNDIALS gives no GMRES solver: not enough memory?");
  SUNLinSolSetATimes(gmres_.get(), this, multiply);
  SUNLinSolSetPreconditioner(gmres_.get(), this, nullptr, precondition);
  SUNLinSolInitialize(gmres_.get());
}

int BondJacobian::multiply(void* self, N_Vector w, N_Vector Jw) {
  auto& own = *static_cast<BondJacobian*>(self);
  if (!own.equilibrium_->tangent(own.u_, field_of(w), field_of(Jw))) return -1;
  const EvaluationStatus status = own.bonds_->add_tangent(own.equilibrium_->at(own.u_), field_of(w), field_of(Jw));
  mask(own.equilibrium_->free(), field_of(Jw));
  return status.ok() ? 0 : -1;
}

int BondJacobian::precondition(void* self, N_Vector r, N_Vector z, realtype, int) {
  auto& own = *static_cast<BondJacobian*>(self);
  fill(0.0, field_of(z));
  std::string note, failure;   // a forecast that fails is none, and says so in one line
  return own.equations_.solve(*own.equilibrium_, field_of(r), own.equations_.exact() ? 0.0 : of_K, field_of(z), note, failure) ? 0 : -1;
}

Solution BondJacobian::solve(Equilibrium& equilibrium, bool extrapolated) {
  const Solution solution = newton_.solve(equilibrium, extrapolated);
  factorised_ = equations_.exact() && solution.converged && solution.iterations > 0;
  return solution;
}

bool BondJacobian::forecast_bonds(Equilibrium& equilibrium, ConstFieldView u, ConstFieldView r) {
  if (!bonds_->any()) return false;
  equilibrium_ = &equilibrium;
  copy(u, u_);
  copy(r, right_);
  fill(0.0, du_);
  // That of the equilibrium, with the bonds that it had, serves as well.
  std::string failure;
  if (!factorised_ && !equations_.linearise(equilibrium, u_, failure)) {
    equilibrium.note("  bonds: no forecast: " + failure);
    return false;
  }
  const double size = norm(right_);
  SUNLinSolSetup(gmres_.get(), nullptr);
  const int flag = SUNLinSolSolve(gmres_.get(), nullptr, solution_.get(), right_vector_.get(), accuracy * size);
  const bool solved = flag == SUNLS_SUCCESS;
  equilibrium.note(fmt::format("  bonds: gmres {:3} to {:.1e}{}", SUNLinSolNumIters(gmres_.get()), SUNLinSolResNorm(gmres_.get()) / size,
                               solved ? "" : "; no forecast"));
  // Past a limit of stability the equations lead back, to a state before it.
  return solved && dot(du_, r) > 0 && bonds_->weaken(equilibrium.at(u_), du_);
}

}  // namespace perikit
