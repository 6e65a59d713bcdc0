#include "kinsol.hpp"

#include <fmt/format.h>
#include <kinsol/kinsol.h>
#include <sunlinsol/sunlinsol_klu.h>
#include <sunlinsol/sunlinsol_spbcgs.h>
#include <sunlinsol/sunlinsol_spfgmr.h>
#include <sunlinsol/sunlinsol_spgmr.h>
#include <sunlinsol/sunlinsol_sptfqmr.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "../shared/assembled_tangent.hpp"
#include "../shared/solver_memory.hpp"
#include "flags.hpp"
#include "perikit/core/field_operations.hpp"
#include "perikit/core/power_of_two.hpp"
#include "perikit/sdk/eigenvalue.hpp"
#include "perikit/sdk/stability.hpp"
#include "perikit/sdk/tangent_predictor.hpp"

namespace perikit {

namespace {

int strategy_number(const std::string& name) {
  return name == "none" ? KIN_NONE : name == "linesearch" ? KIN_LINESEARCH : name == "picard" ? KIN_PICARD : KIN_FP;
}

/// A callback's body: exceptions must not pass through SUNDIALS.
template <class Body>
int guarded(std::exception_ptr& thrown, Body&& body) {
  try {
    return body();
  } catch (...) {
    thrown = std::current_exception();
    return -1;
  }
}

void check(int flag, const char* what) {
  if (flag != 0) throw RunError(fmt::format("kinsol: {} is refused with flag {}", what, flag));
}

}  // namespace

KinsolSolver::KinsolSolver(Problem& problem, const KinsolOptions& options, std::unique_ptr<Preconditioner> preconditioner)
    : options_(options),
      strategy_(strategy_number(options.strategy)),
      start_(problem.make_field()),
      displacement_scale_(problem.make_field()),
      force_scale_(problem.make_field()),
      preconditioner_(std::move(preconditioner)),
      template_(wrap(problem, start_, context_)),
      displacement_scale_vector_(wrap(problem, displacement_scale_, context_)),
      force_scale_vector_(wrap(problem, force_scale_, context_)) {
  memory_ = KINCreate(context_);
  if (!memory_) throw RunError("kinsol: not enough memory");
  KINSetErrHandlerFn(
      memory_, [](int, const char*, const char*, char*, void*) {}, nullptr);
  check(KINSetUserData(memory_, this), "the problem");
  // The depth must stand before KINInit, and below the number of iterations.
  if (fixed_point() || picard())
    check(KINSetMAA(memory_, std::min(options.anderson, options.load_steps.max_iterations - 1)), "anderson");
  check(KINSetNumMaxIters(memory_, options.load_steps.max_iterations), "max_iterations");
  check(KINInit(memory_, system_function, template_.get()), "the system");
  if (fixed_point()) return;
  if (options.linear_solver == "klu")
    create_direct_solver(problem);
  else
    create_krylov_solver();
  // The tangent, or the question whether the preconditioner still serves, at every iteration.
  check(KINSetMaxSetupCalls(memory_, 1), "the renewal of the tangent");
}

KinsolSolver::~KinsolSolver() {
  if (memory_) KINFree(&memory_);
}

void KinsolSolver::create_krylov_solver() {
  const std::string& name = options_.linear_solver;
  const int vectors = options_.restart, all = options_.restart * (options_.max_restarts + 1);
  const int side = preconditioner_ ? SUN_PREC_RIGHT : SUN_PREC_NONE;
  N_Vector like = template_.get();
  if (name == "spgmr") {
    linear_.reset(SUNLinSol_SPGMR(like, side, vectors, context_));
    SUNLinSol_SPGMRSetMaxRestarts(linear_.get(), options_.max_restarts);
  } else if (name == "spfgmr") {
    linear_.reset(SUNLinSol_SPFGMR(like, side, vectors, context_));
    SUNLinSol_SPFGMRSetMaxRestarts(linear_.get(), options_.max_restarts);
  } else if (name == "spbcgs") {
    linear_.reset(SUNLinSol_SPBCGS(like, side, all, context_));
  } else {
    linear_.reset(SUNLinSol_SPTFQMR(like, side, all, context_));
  }
  if (!linear_) throw RunError("kinsol: the linear solver cannot be created: not enough memory?");
  check(KINSetLinearSolver(memory_, linear_.get(), nullptr), "the linear solver");
  check(KINSetJacTimesVecFn(memory_, tangent_action), "the tangent action");
  if (preconditioner_) check(KINSetPreconditioner(memory_, set_up_preconditioner, precondition), "the preconditioner");
}

void KinsolSolver::create_direct_solver(Problem& problem) {
  matrix_ = std::make_unique<TangentMatrix>(problem, context_);
  linear_.reset(SUNLinSol_KLU(template_.get(), matrix_->get(), context_));
  if (!linear_) throw RunError("kinsol: KLU cannot be set up: not enough memory?");
  // The tangent is symmetric in structure and irreducible: KLU's own orderings, for circuits, fill it up.
  sun_klu_common* common = SUNLinSol_KLUGetCommon(linear_.get());
  common->btf = 0;
  common->ordering = 3;  // by the function
  common->user_order = [](SuiteSparse_long n, SuiteSparse_long* first, SuiteSparse_long* row, SuiteSparse_long* order,
                          sun_klu_common*) -> SuiteSparse_long { return find_elimination_order(n, first, row, order) ? 1 : 0; };
  check(KINSetLinearSolver(memory_, linear_.get(), matrix_->get()), "the linear solver");
  check(KINSetJacFn(memory_, assemble), "the tangent");
}

int KinsolSolver::system_function(N_Vector u, N_Vector value, void* self) {
  auto& solver = *static_cast<KinsolSolver*>(self);
  return guarded(solver.thrown_, [&] {
    Equilibrium& equilibrium = *solver.equilibrium_;
    const FieldView to = field_of(value);
    if (!equilibrium.residual(field_of(u), to)) return 1;  // KINSOL tries shorter steps
    ++solver.evaluations_;
    if (!solver.fixed_point() || solver.evaluations_ % 100 == 1) {
      equilibrium.note(fmt::format("  evaluation {:5}  residual {:.3e}", solver.evaluations_, equilibrium.relative_residual()));
    }
    if (solver.fixed_point())
      combine(1, field_of(u), 1 / solver.mass_, to, to);  // G(u) = u + r/m
    else
      combine(-1, to, 0, to, to);
    return 0;
  });
}

int KinsolSolver::tangent_action(N_Vector w, N_Vector Kw, N_Vector u, booleantype*, void* self) {
  auto& solver = *static_cast<KinsolSolver*>(self);
  return guarded(solver.thrown_, [&] {
    Equilibrium& equilibrium = *solver.equilibrium_;
    const Preconditioner* preconditioner = solver.preconditioner_.get();
    if (!preconditioner || !preconditioner->convex())
      return equilibrium.tangent(solver.linearisation_point(u), field_of(w), field_of(Kw)) ? 0 : 1;
    preconditioner->tangent()->multiply(equilibrium.free(), field_of(w), field_of(Kw));
    return 0;
  });
}

int KinsolSolver::set_up_preconditioner(N_Vector u, N_Vector, N_Vector, N_Vector, void* self) {
  auto& solver = *static_cast<KinsolSolver*>(self);
  return guarded(solver.thrown_, [&] {
    solver.report_linear_iterations();
    Preconditioner& preconditioner = *solver.preconditioner_;
    // KINSOL cannot be told to solve once more: what could be indefinite is looked at before.
    const bool anew = preconditioner.tangent() && far_from(*solver.equilibrium_);
    const ConstFieldView at = solver.linearisation_point(u);
    return (anew ? preconditioner.renew(*solver.equilibrium_, at, solver.callback_failure_)
                 : preconditioner.prepare(*solver.equilibrium_, at, solver.callback_failure_))
               ? 0
               : 1;
  });
}

int KinsolSolver::precondition(N_Vector, N_Vector, N_Vector, N_Vector, N_Vector v, void* self) {
  auto& solver = *static_cast<KinsolSolver*>(self);
  return guarded(solver.thrown_, [&] {
    solver.preconditioner_->apply(field_of(v), field_of(v));
    return 0;
  });
}

int KinsolSolver::assemble(N_Vector u, N_Vector, SUNMatrix, void* self, N_Vector, N_Vector) {
  auto& solver = *static_cast<KinsolSolver*>(self);
  return guarded(solver.thrown_, [&] {
    return solver.matrix_->assemble(*solver.equilibrium_, solver.linearisation_point(u), solver.callback_failure_) ? 0 : 1;
  });
}

void KinsolSolver::report_linear_iterations() {
  long all = 0;
  KINGetNumLinIters(memory_, &all);
  // KINSOL asks for alike accuracies from solve to solve: counted as a digit each.
  if (all > linear_iterations_) preconditioner_->took(static_cast<int>(all - linear_iterations_), 0.1);
  linear_iterations_ = all;
}

bool KinsolSolver::predict(Equilibrium& equilibrium, bool extrapolated, std::string& failure) {
  PreconditionerAction action;
  const ConstFieldView u = equilibrium.displacement();
  if (!extrapolated && (preconditioner_ || matrix_)) {
    // Made at the start as it is: that is where the tangent of the prediction is taken.
    Field r = equilibrium.problem().make_field();
    if (!equilibrium.residual(u, r)) {
      failure = equilibrium.failure();
      return false;
    }
    if (preconditioner_ ? !preconditioner_->prepare(equilibrium, u, failure)
                        : !matrix_->tangent().make(equilibrium, equilibrium.at(u), true, failure))
      return false;
    action = [this](ConstFieldView from, FieldView to) {
      if (preconditioner_)
        preconditioner_->apply(from, to);
      else
        matrix_->tangent().solve(from, to);
    };
  }
  if (predict_by_tangent(equilibrium, extrapolated, action)) return true;
  failure = equilibrium.failure();
  return false;
}

int KinsolSolver::run_once(Equilibrium& equilibrium, double target, Solution& solution) {
  check(KINSetFuncNormTol(memory_, target), "tolerance");
  const FieldVector u = wrap(equilibrium.problem(), equilibrium.displacement(), context_);
  linear_iterations_ = 0;  // KINSOL counts anew
  const int flag = KINSol(memory_, u.get(), strategy_, displacement_scale_vector_.get(), force_scale_vector_.get());
  if (thrown_) std::rethrow_exception(std::exchange(thrown_, nullptr));
  long iterations = 0, linear = 0;
  KINGetNumNonlinSolvIters(memory_, &iterations);
  if (linear_ && !matrix_) KINGetNumLinIters(memory_, &linear);
  if (preconditioner_) report_linear_iterations();
  solution.iterations += static_cast<int>(iterations);
  equilibrium.note(fmt::format("  {} iterations{}", iterations, linear > 0 ? fmt::format(", {} linear ones", linear) : ""));
  return flag;
}

Solution KinsolSolver::solve(Equilibrium& equilibrium, bool extrapolated) {
  Solution solution;
  equilibrium_ = &equilibrium;
  evaluations_ = 0;
  callback_failure_.clear();
  Problem& problem = equilibrium.problem();
  const FieldView u = equilibrium.displacement();
  if (!predict(equilibrium, extrapolated, solution.failure)) return solution;
  copy(u, start_);
  Field r = problem.make_field();
  const auto evaluate = [&] {
    if (equilibrium.residual(u, r)) return true;
    solution.failure = equilibrium.failure();
    return false;
  };
  if (!evaluate()) return solution;
  if (fixed_point()) {
    if (eigenvector_.size() == 0) eigenvector_ = problem.make_field();
    mass_ = largest_eigenvalue(problem, u, equilibrium.free(), eigenvector_, false, [&] { return equilibrium.goes_on(); });
    if (!(mass_ > 0)) {
      solution.failure = equilibrium.stopped() ? equilibrium.failure() : "the stiffness of the free points is zero or cannot be found";
      return solution;
    }
  }
  // KINSOL measures forces by their largest component, a fixed-point iteration by steps, here times m.
  const double unit = power_of_two(std::max(equilibrium.reference(), equilibrium.residual_norm()));   // KINSOL takes squares
  fill(1 / unit, force_scale_);
  fill(fixed_point() ? mass_ / unit : 1 / problem.points().spacing(), displacement_scale_);
  const double free_components = std::sqrt(std::max(1.0, dot(equilibrium.free(), equilibrium.free())));
  check(KINSetMaxNewtonStep(memory_, 1e3 * free_components * (1 + norm(u) / problem.points().spacing())), "the largest step");
  check(KINSetScaledStepTol(memory_, 1e-15), "the smallest step");
  // Reactions, and with them the reference, change on the way: the target is set anew until the equilibrium itself says that it
  // is met.
  double strictness = 1;
  for (int attempt = 0; attempt < 5 && !equilibrium.converged(); ++attempt, strictness /= 4) {
    const int flag =
        run_once(equilibrium, strictness * equilibrium.tolerance() * equilibrium.reference() / (unit * free_components), solution);
    if (flag < 0) {
      solution.failure = callback_failure_.empty() ? kinsol_flag_meaning(flag) : callback_failure_;
      // The state is kept where the norm that counts is met after all.
      if (!evaluate()) return solution;
      break;
    }
    if (!evaluate()) return solution;
    if (flag == KIN_STEP_LT_STPTOL && !equilibrium.converged()) {
      solution.failure = kinsol_flag_meaning(flag);
      break;
    }
  }
  solution.converged = equilibrium.converged();
  if (!solution.converged && solution.failure.empty()) {
    solution.failure = fmt::format("KINSOL leaves a residual of {:.3g} (tolerance {:.3g})", equilibrium.relative_residual(),
                                   equilibrium.tolerance());
  }
  return solution;
}

bool KinsolSolver::unstable(Equilibrium& equilibrium, ConstFieldView u, bool last) {
  if (!last) return false;
  if (preconditioner_) return preconditioner_->finds_unstable(equilibrium, u);
  std::string failure;
  if (matrix_) return matrix_->tangent().make(equilibrium, equilibrium.at(u), false, failure) && matrix_->tangent().indefinite();
  return has_negative_curvature(equilibrium, u);
}

double Kinsol::memory(Problem& problem) {
  const int vectors = options_.linear_solver == "spgmr" ? options_.restart : options_.linear_solver == "spfgmr" ? 2 * options_.restart : 10;
  if (options_.strategy == "fixed_point") return krylov_solver_bytes(problem, "none", 2 * static_cast<int>(options_.anderson));
  // KLU keeps both factors, with indices, and beside the tangent the whole matrix in columns.
  return krylov() ? krylov_solver_bytes(problem, options_.preconditioner, vectors) : 4 * direct_solver_bytes(problem);
}

void Kinsol::run(Problem& problem, Observer& observer) {
  std::string chosen;
  auto preconditioner = krylov() ? make_preconditioner(options_.preconditioner, problem, chosen) : nullptr;
  if (krylov()) observer.log("kinsol: preconditioner " + chosen);
  KinsolSolver solver(problem, options_, std::move(preconditioner));
  run_load_steps("kinsol", options_.load_steps, problem, observer, solver);
}

}  // namespace perikit
