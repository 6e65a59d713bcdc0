#include "krylov_equations.hpp"

#include <fmt/format.h>
#include <sunlinsol/sunlinsol_spgmr.h>

#include "assembled_tangent.hpp"
#include "mixed_equations.hpp"
#include "perikit/core/field_operations.hpp"
#include "perikit/core/power_of_two.hpp"
#include "perikit/sdk/stability.hpp"

namespace perikit {

KrylovEquations::KrylovEquations(Problem& problem, const KrylovOptions& options, std::unique_ptr<Preconditioner> preconditioner)
    : problem_(problem),
      options_(options),
      preconditioner_(std::move(preconditioner)),
      action_(problem, options.differences),
      right_(problem.make_field()),
      right_vector_(wrap(problem, right_, context_)) {
  // Preconditioned from the right: GMRES then watches the true residual.
  gmres_.reset(SUNLinSol_SPGMR(right_vector_.get(), preconditioner_ ? SUN_PREC_RIGHT : SUN_PREC_NONE, options.restart, context_));
  if (!gmres_) throw RunError("SUNDIALS gives no GMRES solver: not enough memory?");
  SUNLinSolSetATimes(gmres_.get(), this, multiply);
  if (preconditioner_) SUNLinSolSetPreconditioner(gmres_.get(), this, nullptr, precondition);
  SUNLinSolInitialize(gmres_.get());
}

bool KrylovEquations::linearise(Equilibrium& equilibrium, ConstFieldView u, std::string& failure) {
  action_.move_to(u);
  return !preconditioner_ || preconditioner_->prepare(equilibrium, action_.state(), failure);
}

bool KrylovEquations::apply(Equilibrium& equilibrium, ConstFieldView w, FieldView Kw, std::string& failure) {
  return action_.apply(equilibrium, w, Kw, failure);
}

int KrylovEquations::multiply(void* self, N_Vector w, N_Vector Kw) {
  auto& equations = *static_cast<KrylovEquations*>(self);
  return equations.apply(*equations.equilibrium_, field_of(w), field_of(Kw), equations.failure_) ? 0 : -1;
}

int KrylovEquations::precondition(void* self, N_Vector r, N_Vector z, realtype, int) {
  static_cast<KrylovEquations*>(self)->preconditioner_->apply(field_of(r), field_of(z));
  return 0;
}

bool KrylovEquations::iterate(ConstFieldView rhs, double accuracy, int max_restarts, FieldView du, std::string& note) {
  failure_.clear();
  fill(0.0, du);
  // In a unit that GMRES can take squares in.
  const double unit = power_of_two(norm(rhs));
  combine(1 / unit, rhs, 0, rhs, right_);
  const double size = norm(right_);
  const FieldVector solution = wrap(problem_, du, context_);
  SUNLinSol_SPGMRSetMaxRestarts(gmres_.get(), max_restarts);
  SUNLinSolSetZeroGuess(gmres_.get(), SUNTRUE);
  SUNLinSolSetup(gmres_.get(), nullptr);
  const int flag = SUNLinSolSolve(gmres_.get(), nullptr, solution.get(), right_vector_.get(), accuracy * size);
  combine(unit, du, 0, du, du);
  iterations_ = SUNLinSolNumIters(gmres_.get());
  reached_ = size > 0 ? SUNLinSolResNorm(gmres_.get()) / size : 0.0;
  note += fmt::format("  gmres {:4} to {:.1e}", iterations_, reached_);
  // A direction that was not solved to the accuracy asked for is still one that lowers the residual.
  return flag == SUNLS_SUCCESS || (flag == SUNLS_RES_REDUCED && reached_ < 0.9);
}

bool KrylovEquations::solve(Equilibrium& equilibrium, ConstFieldView rhs, double accuracy, FieldView du, std::string& note,
                            std::string& failure) {
  equilibrium_ = &equilibrium;
  // Where the tangent is indefinite far from equilibrium, GMRES takes long, or finds a direction that leads uphill.
  const bool doubtful = preconditioner_ && preconditioner_->tangent() && far_from(equilibrium) && !problem_.constant_stiffness();
  bool convex = preconditioner_ && preconditioner_->convex();
  bool solved = !convex && iterate(rhs, accuracy, doubtful ? 0 : options_.max_restarts, du, note);
  if (doubtful && !convex && (!solved || reached_ > accuracy || dot(du, rhs) <= 0)) {
    if (!preconditioner_->renew(equilibrium, action_.state(), failure)) return false;
    convex = preconditioner_->convex();
    if (!convex) solved = iterate(rhs, accuracy, options_.max_restarts, du, note);
  }
  if (convex) {
    preconditioner_->apply(rhs, du);
    note += "  tangent made convex";
    return true;
  }
  if (preconditioner_) preconditioner_->took(iterations_, reached_);
  if (solved) return true;
  failure = !failure_.empty() ? failure_
                              : fmt::format("GMRES reduces the linear residual only to {:.2g} in {} iterations (restart {})",
                                            reached_, iterations_, options_.restart);
  return false;
}

bool KrylovEquations::unstable(Equilibrium& equilibrium, ConstFieldView u, bool last) {
  if (!last) return false;
  return preconditioner_ ? preconditioner_->finds_unstable(equilibrium, u) : has_negative_curvature(equilibrium, u);
}

std::unique_ptr<LinearisedProblem> make_krylov_equations(Problem& problem, const KrylovOptions& options, std::string& chosen) {
  const bool asked = options.preconditioner == "mixed";
  if (asked || (options.preconditioner == "auto" && mixed_pays(problem))) {
    if (std::unique_ptr<VolumetricPart> volumes = problem.volumetric_part()) {
      chosen = "mixed";
      return std::make_unique<MixedEquations>(problem, options, std::move(volumes), chosen);
    }
    if (asked) return nullptr;
  }
  return std::make_unique<KrylovEquations>(problem, options, make_preconditioner(options.preconditioner, problem, chosen));
}

}  // namespace perikit
