#pragma once
#include "perikit/sdk/load_steps.hpp"

namespace perikit {

struct RelaxationOptions {
  LoadStepOptions load_steps;
  bool kinetic = false;  ///< kinetic damping instead of viscous damping
};

/// One equilibrium by dynamic relaxation: damped motion of fictitious masses, one force evaluation an iteration.
class Relaxation final : public EquilibriumSolver {
 public:
  Relaxation(Problem& problem, const RelaxationOptions& options);
  Solution solve(Equilibrium& equilibrium, bool extrapolated) override;
  /// It moves on from unstable equilibria where anything pushes it aside: a body that is symmetric to rounding stays.
  bool unstable(Equilibrium& equilibrium, ConstFieldView u, bool last) override;

 private:
  /// Mass on every component for which steps of length 1 are stable at u [N/m]; 0 where there is none.
  double find_mass(Equilibrium& equilibrium);

  RelaxationOptions options_;
  FieldView eigenvector_;  ///< of the last estimate; kept with the problem
  Field r_, last_r_, v_;
};

class DynamicRelaxation final : public Integrator {
 public:
  explicit DynamicRelaxation(const RelaxationOptions& options) : options_(options) {}
  IntegratorTraits traits() const noexcept override { return {.dynamic = false, .quasi_static = true, .several_ranks = true}; }
  void run(Problem& problem, Observer& observer) override;

 private:
  RelaxationOptions options_;
};

}  // namespace perikit
