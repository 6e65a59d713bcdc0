#pragma once
#include "krylov_equations.hpp"
#include "mixed_system.hpp"

namespace perikit {

/// The linearised equations of nearly incompressible bodies: displacements and pressures by SUNDIALS' flexible GMRES (the inner
/// iterations make each product with the preconditioner a little different).
class MixedEquations final : public LinearisedProblem {
 public:
  /// chosen: of MixedSystem.
  MixedEquations(Problem& problem, const KrylovOptions& options, std::unique_ptr<VolumetricPart> volumes, std::string& chosen);
  bool linearise(Equilibrium& equilibrium, ConstFieldView u, std::string& failure) override;
  bool apply(Equilibrium& equilibrium, ConstFieldView w, FieldView Kw, std::string& failure) override;
  bool solve(Equilibrium& equilibrium, ConstFieldView rhs, double accuracy, FieldView du, std::string& note,
             std::string& failure) override;
  void refine(Equilibrium& equilibrium, ConstFieldView u, FieldView du, std::string& note) override;
  bool refine_extrapolation(Equilibrium& equilibrium, ConstFieldView u, FieldView du, std::string& note) override;
  double accuracy_for_motions(double accuracy) const override;
  bool exact() const noexcept override { return false; }
  bool unstable(Equilibrium& equilibrium, ConstFieldView u, bool last) override;
  void bonds_changed() override { system_.discard(); }

 private:
  static int multiply(void* self, N_Vector x, N_Vector y);
  static int precondition(void* self, N_Vector r, N_Vector z, realtype tolerance, int side);

  int max_restarts_, restart_;
  TangentAction action_;
  MixedSystem system_;
  SundialsContext context_;
  Field right_, solution_;
  FieldVector right_vector_, solution_vector_;
  LinearSolver gmres_;
  Equilibrium* equilibrium_ = nullptr;  ///< of the solve in progress
  std::string failure_;
};

}  // namespace perikit
