#pragma once
/// The linearised equations of load steps, solved by Krylov methods on tangent actions.

#include <sundials/sundials_linearsolver.h>

#include <memory>
#include <string>

#include "field_vector.hpp"
#include "perikit/sdk/newton_iteration.hpp"
#include "preconditioner.hpp"
#include "tangent_action.hpp"

namespace perikit {

struct KrylovOptions {
  bool differences = false;  ///< tangent by central differences instead of exactly
  std::string preconditioner = "auto";
  int restart = 60;  ///< Krylov vectors before GMRES restarts
  int max_restarts = 20;
};

/// SUNDIALS' restarted GMRES on tangent actions, with those of following loads.
class KrylovEquations final : public LinearisedProblem {
 public:
  KrylovEquations(Problem& problem, const KrylovOptions& options, std::unique_ptr<Preconditioner> preconditioner);
  bool linearise(Equilibrium& equilibrium, ConstFieldView u, std::string& failure) override;
  bool apply(Equilibrium& equilibrium, ConstFieldView w, FieldView Kw, std::string& failure) override;
  bool solve(Equilibrium& equilibrium, ConstFieldView rhs, double accuracy, FieldView du, std::string& note,
             std::string& failure) override;
  bool exact() const noexcept override { return false; }
  bool unstable(Equilibrium& equilibrium, ConstFieldView u, bool last) override;
  void bonds_changed() override {
    if (preconditioner_) preconditioner_->discard();
  }

 private:
  static int multiply(void* self, N_Vector w, N_Vector Kw);
  static int precondition(void* self, N_Vector r, N_Vector z, realtype tolerance, int side);
  /// One run of GMRES on the exact tangent. False where it fails; failure_ then says why, if it knows.
  bool iterate(ConstFieldView rhs, double accuracy, int max_restarts, FieldView du, std::string& note);

  Problem& problem_;
  KrylovOptions options_;
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

/// KrylovEquations, or the mixed ones of nearly incompressible bodies where the preconditioner "mixed" is asked for, or "auto" and they pay. `chosen`:
/// the preconditioner. Null where "mixed" is asked for and the kinematics has no point volumes.
std::unique_ptr<LinearisedProblem> make_krylov_equations(Problem& problem, const KrylovOptions& options, std::string& chosen);

}  // namespace perikit
