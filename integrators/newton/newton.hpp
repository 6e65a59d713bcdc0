#pragma once
#include "../shared/assembled_tangent.hpp"
#include "../shared/bond_jacobian.hpp"
#include "../shared/krylov_equations.hpp"

namespace perikit {

/// The linearised equations, assembled and factorised at every state; once where the stiffness is constant.
class FactorisedEquations final : public LinearisedProblem {
 public:
  bool linearise(Equilibrium& equilibrium, ConstFieldView u, std::string& failure) override;
  bool apply(Equilibrium& equilibrium, ConstFieldView w, FieldView Kw, std::string& failure) override;
  bool solve(Equilibrium& equilibrium, ConstFieldView rhs, double accuracy, FieldView du, std::string& note,
             std::string& failure) override;
  bool exact() const noexcept override { return true; }
  bool unstable(Equilibrium& equilibrium, ConstFieldView u, bool last) override;

 private:
  AssembledTangent tangent_;
  ConstFieldView u_;  ///< where the equations are linearised
  bool warned_ = false;
  bool in_step_ = false;  ///< a tangent was made in this load step
};

/// Newton's method [Hashim et al., eqs. 21-29] with the exact tangent, assembled and factorised where that is predicted to be cheaper, else by GMRES.
class Newton final : public Integrator {
 public:
  explicit Newton(const ParameterValues& values) : values_(values) {}
  IntegratorTraits traits() const noexcept override { return {.dynamic = false, .quasi_static = true}; }
  /// Nothing to tell; refuses what the run would.
  std::string plan(Problem& problem) override;
  double memory(Problem& problem) override;
  void run(Problem& problem, Observer& observer) override;

 private:
  /// Whether linear systems are solved by factors of the tangent.
  bool direct(Problem& problem) const;

  ParameterValues values_;
};

}  // namespace perikit
