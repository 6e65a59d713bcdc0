#pragma once
/// Newton's method for bodies whose bonds weaken gradually, with the Jacobian of the degrading bonds.

#include <memory>
#include <string_view>

#include "field_vector.hpp"
#include "perikit/plugin/parameters.hpp"
#include "perikit/sdk/newton_iteration.hpp"

namespace perikit {

/// Adds the key `bond_jacobian`.
void add_bond_jacobian_key(ParameterTable& table);

/// The bonds of the Jacobian where `values` ask for it, else null. Throws InputError where they do and no bond weakens gradually, or on several ranks.
std::unique_ptr<WeakeningBonds> bonds_of_jacobian(const ParameterValues& values, Problem& problem);

/// Runs the load steps of `problem` with Newton's method on `equations`; with the Jacobian of the degrading bonds where `values`
/// ask for it (bonds_of_jacobian).
void run_newton(std::string_view integrator, const ParameterValues& values, Problem& problem, Observer& observer, LinearisedProblem& equations);

/// Where bonds weakened at an equilibrium they go on weakening, as the body gives way. With r the force that is out of balance and the
/// Jacobian of Hashim et al., eqs. 50-54 (WeakeningBonds),
///
///   (K - df/db db/du) du = r
///
/// says how far the body moves until bonds and displacements agree, by SUNDIALS' flexible GMRES preconditioned with K; the bonds
/// weaken to what they are at u + du. Without it they would weaken by one term of the series in K^-1 df/db db/du after the other.
/// Equilibrium is then found with bonds that do not change, as ever.
class BondJacobian final : public EquilibriumSolver {
 public:
  /// All must outlive it.
  BondJacobian(Problem& problem, NewtonIteration& newton, LinearisedProblem& equations, std::unique_ptr<WeakeningBonds> bonds);
  Solution solve(Equilibrium& equilibrium, bool extrapolated) override;
  bool forecast_bonds(Equilibrium& equilibrium, ConstFieldView u, ConstFieldView r) override;
  bool unstable(Equilibrium& equilibrium, ConstFieldView u, bool last) override { return newton_.unstable(equilibrium, u, last); }
  void bonds_changed() override { newton_.bonds_changed(); }

 private:
  static int multiply(void* self, N_Vector w, N_Vector Jw);
  static int precondition(void* self, N_Vector r, N_Vector z, realtype tolerance, int side);

  NewtonIteration& newton_;
  LinearisedProblem& equations_;
  std::unique_ptr<WeakeningBonds> bonds_;
  SundialsContext context_;
  bool factorised_ = false;  ///< K, by the last solve
  Field u_, right_, du_;
  FieldVector right_vector_, solution_;
  LinearSolver gmres_;
  Equilibrium* equilibrium_ = nullptr;  ///< of the forecast in progress
};

}  // namespace perikit
