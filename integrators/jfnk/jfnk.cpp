#include "jfnk.hpp"

#include <fmt/format.h>
#include <sunlinsol/sunlinsol_spgmr.h>

#include "../shared/assembled_tangent.hpp"
#include "mixed_equations.hpp"
#include "perikit/core/communicator.hpp"
#include "perikit/core/field_operations.hpp"

namespace perikit {

KrylovEquations::KrylovEquations(Problem& problem, const JfnkOptions& options, std::unique_ptr<Preconditioner> preconditioner)
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
  copy(rhs, right_);
  const double size = norm(rhs);
  const FieldVector solution = wrap(problem_, du, context_);
  SUNLinSol_SPGMRSetMaxRestarts(gmres_.get(), max_restarts);
  SUNLinSolSetZeroGuess(gmres_.get(), SUNTRUE);
  SUNLinSolSetup(gmres_.get(), nullptr);
  const int flag = SUNLinSolSolve(gmres_.get(), nullptr, solution.get(), right_vector_.get(), accuracy * size);
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

void Jfnk::run(Problem& problem, Observer& observer) {
  std::string chosen;
  const bool asked = options_.preconditioner == "mixed";
  if (asked || (options_.preconditioner == "auto" && mixed_pays(problem))) {
    if (std::unique_ptr<VolumetricPart> volumes = problem.volumetric_part()) {
      chosen = "mixed";
      MixedEquations equations(problem, options_, std::move(volumes), chosen);
      observer.log("jfnk: preconditioner " + chosen);
      return run_newton("jfnk", options_.values, problem, observer, equations);
    }
    if (asked)
      throw options_.values.error("preconditioner",
                                  std::string("found \"mixed\", which needs the point volumes of selective kinematics; allowed here: "
                                              "auto, none, companion") +
                                      (communicator().size() == 1 ? ", jacobi, factorisation" : ""));
  }
  auto preconditioner = make_preconditioner(options_.preconditioner, problem, chosen);
  observer.log("jfnk: preconditioner " + chosen);
  KrylovEquations equations(problem, options_, std::move(preconditioner));
  run_newton("jfnk", options_.values, problem, observer, equations);
}

}  // namespace perikit
