#pragma once
#include <exception>
#include <memory>
#include <string>

#include "../shared/field_vector.hpp"
#include "../shared/preconditioner.hpp"
#include "perikit/sdk/load_steps.hpp"
#include "tangent_matrix.hpp"

namespace perikit {

struct KinsolOptions {
  LoadStepOptions load_steps;
  std::string strategy = "linesearch";  ///< none, linesearch, picard, fixed_point
  std::string linear_solver = "spgmr";  ///< spgmr, spfgmr, spbcgs, sptfqmr, klu
  std::string preconditioner = "auto";  ///< of the Krylov solvers
  int restart = 60;                     ///< Krylov vectors of spgmr and spfgmr
  int max_restarts = 20;
  std::int64_t anderson = 10;  ///< depth of Anderson acceleration
};

/// One equilibrium by KINSOL: F(u) = -r(u), whose Jacobian is the stiffness; prescribed components have F = 0 and never move.
class KinsolSolver final : public EquilibriumSolver {
 public:
  /// preconditioner: null for none, klu and fixed_point.
  KinsolSolver(Problem& problem, const KinsolOptions& options, std::unique_ptr<Preconditioner> preconditioner);
  ~KinsolSolver() override;
  KinsolSolver(const KinsolSolver&) = delete;
  KinsolSolver& operator=(const KinsolSolver&) = delete;
  Solution solve(Equilibrium& equilibrium, bool extrapolated) override;
  bool unstable(Equilibrium& equilibrium, ConstFieldView u, bool last) override;
  void bonds_changed() override {
    if (preconditioner_) preconditioner_->discard();
  }

 private:
  static int system_function(N_Vector u, N_Vector value, void* self);
  static int tangent_action(N_Vector w, N_Vector Kw, N_Vector u, booleantype* new_u, void* self);
  static int set_up_preconditioner(N_Vector u, N_Vector, N_Vector value, N_Vector, void* self);
  static int precondition(N_Vector u, N_Vector, N_Vector value, N_Vector, N_Vector v, void* self);
  static int assemble(N_Vector u, N_Vector value, SUNMatrix K, void* self, N_Vector, N_Vector);
  void create_krylov_solver();
  void create_direct_solver(Problem& problem);
  /// Start values of a step, by the tangent where they are not extrapolated.
  bool predict(Equilibrium& equilibrium, bool extrapolated, std::string& failure);
  /// Tells the preconditioner how many iterations the last linear solve took.
  void report_linear_iterations();
  /// Where the linear operator is taken: at u, for Picard at the start of the step.
  ConstFieldView linearisation_point(N_Vector u) const { return picard() ? ConstFieldView(start_) : ConstFieldView(field_of(u)); }
  /// Runs KINSol from the present state to a largest component of `target` [N]; returns its flag.
  int run_once(Equilibrium& equilibrium, double target, Solution& solution);
  bool fixed_point() const noexcept { return options_.strategy == "fixed_point"; }
  bool picard() const noexcept { return options_.strategy == "picard"; }

  KinsolOptions options_;
  int strategy_;
  SundialsContext context_;
  Field start_, displacement_scale_, force_scale_, eigenvector_;
  std::unique_ptr<Preconditioner> preconditioner_;
  std::unique_ptr<TangentMatrix> matrix_;  ///< klu only
  FieldVector template_, displacement_scale_vector_, force_scale_vector_;
  LinearSolver linear_;
  void* memory_ = nullptr;
  Equilibrium* equilibrium_ = nullptr;  ///< of the solve in progress
  double mass_ = 0;                     ///< m of the fixed-point map u + r/m [N/m]
  std::int64_t evaluations_ = 0;
  long linear_iterations_ = 0;    ///< of the run of KINSOL in progress, as far as reported
  std::string callback_failure_;  ///< why a callback gave up
  std::exception_ptr thrown_;
};

class Kinsol final : public Integrator {
 public:
  explicit Kinsol(const KinsolOptions& options) : options_(options) {}
  IntegratorTraits traits() const noexcept override {
    const bool matrix = krylov() ? needs_one_rank(options_.preconditioner) : options_.strategy != "fixed_point";
    return {.dynamic = false, .quasi_static = true, .several_ranks = !matrix};
  }
  double memory(Problem& problem) override;
  void run(Problem& problem, Observer& observer) override;

 private:
  bool krylov() const noexcept { return options_.strategy != "fixed_point" && options_.linear_solver != "klu"; }

  KinsolOptions options_;
};

}  // namespace perikit
