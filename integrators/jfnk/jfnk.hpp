#pragma once
#include <sundials/sundials_linearsolver.h>

#include <memory>

#include "../shared/bond_jacobian.hpp"
#include "../shared/preconditioner.hpp"
#include "tangent_action.hpp"

namespace perikit {

struct JfnkOptions {
  bool differences = false;  ///< tangent by central differences instead of exactly
  std::string preconditioner = "auto";
  int restart = 60;  ///< Krylov vectors before GMRES restarts
  int max_restarts = 20;
  ParameterValues values;  ///< as the scene has them: load steps, and for errors
};

/// Krylov solution of the linearised equations: SUNDIALS' restarted GMRES on tangent actions.
class KrylovEquations final : public LinearisedProblem {
 public:
  KrylovEquations(Problem& problem, const JfnkOptions& options, std::unique_ptr<Preconditioner> preconditioner);
  bool linearise(Equilibrium& equilibrium, ConstFieldView u, std::string& failure) override;
  bool apply(Equilibrium& equilibrium, ConstFieldView w, FieldView Kw, std::string& failure) override;
  bool solve(Equilibrium& equilibrium, ConstFieldView rhs, double accuracy, FieldView du, std::string& note,
             std::string& failure) override;
  bool exact() const noexcept override { return false; }
  void bonds_changed() override {
    if (preconditioner_) preconditioner_->discard();
  }

 private:
  static int multiply(void* self, N_Vector w, N_Vector Kw);
  static int precondition(void* self, N_Vector r, N_Vector z, realtype tolerance, int side);
  /// One run of GMRES on the exact tangent. False where it fails; failure_ then says why, if it knows.
  bool iterate(ConstFieldView rhs, double accuracy, int max_restarts, FieldView du, std::string& note);

  Problem& problem_;
  JfnkOptions options_;
  std::unique_ptr<Preconditioner> preconditioner_;
  TangentAction action_;
  SundialsContext context_;
  Field right_;
  FieldVector right_vector_;
  LinearSolver gmres_;
  Equilibrium* equilibrium_ = nullptr;  ///< of the solve in progress
  int iterations_ = 0;                  ///< of the last run of GMRES
  double reached_ = 0;                  ///< linear residual over the right-hand side after it
  std::string failure_;
};

/// Jacobian-free Newton-Krylov [Partmann et al., eqs. 3.69-3.81].
class Jfnk final : public Integrator {
 public:
  explicit Jfnk(const JfnkOptions& options) : options_(options) {}
  IntegratorTraits traits() const noexcept override {
    return {.dynamic = false, .quasi_static = true, .several_ranks = !needs_one_rank(options_.preconditioner)};
  }
  void run(Problem& problem, Observer& observer) override;

 private:
  JfnkOptions options_;
};

}  // namespace perikit
