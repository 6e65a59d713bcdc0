#include "mixed_equations.hpp"

#include <fmt/format.h>
#include <sunlinsol/sunlinsol_spfgmr.h>

#include <algorithm>

#include "perikit/core/field_operations.hpp"
#include "perikit/core/power_of_two.hpp"
#include "perikit/sdk/stability.hpp"

namespace perikit {

namespace {

/// Errors of volumes before and after a correction. False where there was none.
bool say(const std::pair<double, double>& errors, std::string& note) {
  const auto [before, after] = errors;
  if (after >= before) return false;
  note += fmt::format("  volumes {:.1e} to {:.1e}", before, after);
  return true;
}

}  // namespace

MixedEquations::MixedEquations(Problem& problem, const KrylovOptions& options, std::unique_ptr<VolumetricPart> volumes, std::string& chosen)
    : max_restarts_(options.max_restarts),
      restart_(options.restart),
      action_(problem, options.differences),
      system_(problem, std::move(volumes), chosen),
      right_(system_.make_vector()),
      solution_(system_.make_vector()),
      right_vector_(wrap(problem, right_, context_)),
      solution_vector_(wrap(problem, solution_, context_)) {
  gmres_.reset(SUNLinSol_SPFGMR(right_vector_.get(), SUN_PREC_RIGHT, options.restart, context_));
  if (!gmres_) throw RunError("SUNDIALS gives no GMRES solver: not enough memory?");
  SUNLinSolSetATimes(gmres_.get(), this, multiply);
  SUNLinSolSetPreconditioner(gmres_.get(), this, nullptr, precondition);
  SUNLinSolInitialize(gmres_.get());
}

bool MixedEquations::linearise(Equilibrium& equilibrium, ConstFieldView u, std::string& failure) {
  action_.move_to(u);
  return system_.linearise(equilibrium, action_.state(), failure);
}

bool MixedEquations::apply(Equilibrium& equilibrium, ConstFieldView w, FieldView Kw, std::string& failure) {
  return action_.apply(equilibrium, w, Kw, failure);
}

int MixedEquations::multiply(void* self, N_Vector x, N_Vector y) {
  auto& own = *static_cast<MixedEquations*>(self);
  const auto K = [&](ConstFieldView w, FieldView Kw) { return own.apply(*own.equilibrium_, w, Kw, own.failure_); };
  return own.system_.multiply(K, field_of(x), field_of(y)) ? 0 : -1;
}

int MixedEquations::precondition(void* self, N_Vector r, N_Vector z, realtype, int) {
  static_cast<MixedEquations*>(self)->system_.precondition(field_of(r), field_of(z));
  return 0;
}

bool MixedEquations::solve(Equilibrium& equilibrium, ConstFieldView rhs, double accuracy, FieldView du, std::string& note,
                           std::string& failure) {
  equilibrium_ = &equilibrium;
  failure_.clear();
  fill(0.0, right_);
  fill(0.0, solution_);
  // In a unit that GMRES can take squares in.
  const double unit = power_of_two(norm(rhs));
  combine(1 / unit, rhs, 0, rhs, system_.displacement(right_));
  const double size = norm(system_.displacement(right_));
  SUNLinSol_SPFGMRSetMaxRestarts(gmres_.get(), max_restarts_);
  SUNLinSolSetup(gmres_.get(), nullptr);
  const int flag = SUNLinSolSolve(gmres_.get(), nullptr, solution_vector_.get(), right_vector_.get(), accuracy * size);
  combine(unit, solution_, 0, solution_, solution_);
  copy(system_.displacement(solution_), du);
  const int iterations = SUNLinSolNumIters(gmres_.get());
  const double reached = size > 0 ? SUNLinSolResNorm(gmres_.get()) / size : 0.0;
  note += fmt::format("  gmres {:4} to {:.1e}", iterations, reached);
  system_.took(iterations, reached);
  if (flag == SUNLS_SUCCESS || (flag == SUNLS_RES_REDUCED && reached < 0.9)) return true;
  failure = !failure_.empty() ? failure_
                              : fmt::format("GMRES reduces the linear residual only to {:.2g} in {} iterations (restart {})",
                                            reached, iterations, restart_);
  return false;
}

bool MixedEquations::unstable(Equilibrium& equilibrium, ConstFieldView u, bool last) {
  std::string failure;
  if (!last || !system_.linearise(equilibrium, u, failure)) return false;
  const PreconditionerAction precondition = [this](ConstFieldView r, FieldView z) { system_.invert_companion(r, z); };
  // K = A + B^T W B with W > 0: where A is positive, so is K. The companion stands for A, and conjugate gradients come to their end.
  const auto A = [&](ConstFieldView w, FieldView Aw) {
    return system_.multiply_without_volumes([&](ConstFieldView v, FieldView Kv) { return equilibrium.tangent(u, v, Kv); }, w, Aw);
  };
  if (curvature_of(equilibrium.problem(), equilibrium.free(), A, precondition) == Curvature::positive) return false;
  // The companion does not know the bulk moduli: where these are large, conjugate gradients on K hardly ever come to their end. They meet a buckling mode long
  // before.
  constexpr int most = 200;
  return has_negative_curvature(equilibrium, u, precondition, most);
}

double MixedEquations::accuracy_for_motions(double accuracy) const {
  // The rim alone cannot move without changing volumes: its forces are bulk moduli times strains, those of the answer shear moduli.
  return accuracy * std::min(1.0, 100 / std::max(1.0, system_.largest_ratio()));
}

void MixedEquations::refine(Equilibrium& equilibrium, ConstFieldView u, FieldView du, std::string& note) {
  say(system_.correct(u, solution_, 0.1 * equilibrium.tolerance() * equilibrium.reference(), du), note);
}

bool MixedEquations::refine_extrapolation(Equilibrium& equilibrium, ConstFieldView u, FieldView du, std::string& note) {
  std::string failure;
  return system_.linearise_volumes(equilibrium, u, failure) && say(system_.keep_volumes(u, du), note);
}

}  // namespace perikit
