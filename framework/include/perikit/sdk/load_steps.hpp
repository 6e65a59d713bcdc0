#pragma once
/// Load stepping, shared by every quasi-static integrator.

#include <cstdint>
#include <string>
#include <string_view>

#include "perikit/plugin/parameters.hpp"
#include "perikit/problem/integrator.hpp"
#include "perikit/sdk/equilibrium.hpp"

namespace perikit {

struct LoadStepOptions {
  std::int64_t steps = 10;        ///< planned steps from load parameter 0 to 1
  double tolerance = 1e-8;        ///< of the residual, relative to reactions and loads
  std::int64_t max_iterations = 25;
  std::int64_t cut_backs = 10;    ///< halvings of a planned step before the run gives up
  std::int64_t bond_rounds = 1000;  ///< times that bonds may fail at one load
};

/// A table with the keys steps, tolerance, max_iterations, cut_backs, bond_rounds. `max_iterations`: its default.
ParameterTable load_step_parameters(std::int64_t max_iterations);
LoadStepOptions load_step_options(const ParameterValues& values);

/// How one solve ended.
struct Solution {
  bool converged = false;
  int iterations = 0;
  std::string failure;            ///< where it did not converge: why, as part of a sentence
};

/// Solves one equilibrium.
class EquilibriumSolver {
 public:
  virtual ~EquilibriumSolver() = default;
  /// Starts from equilibrium.displacement() and leaves the answer there, prescribed components included. `extrapolated`: the start
  /// continues the path of the last steps, else it is the last equilibrium.
  virtual Solution solve(Equilibrium& equilibrium, bool extrapolated) = 0;
  /// After a step that converged, `u` its displacement: where state that later steps reuse may be renewed.
  virtual void accepted(Problem&, ConstFieldView /*u*/) {}
  /// True where the equilibrium u, which has converged, is found to be unstable: there is a motion that the body would make on its own. last: the run
  /// ends here, and some tens of tangent actions are worth it; before, only where it costs next to nothing.
  virtual bool unstable(Equilibrium&, ConstFieldView /*u*/, bool /*last*/) { return false; }
  /// Bonds have weakened at the equilibrium u, which left it out of balance by r. Solvers that know how far they go on weakening let them do
  /// so; true when they did.
  virtual bool forecast_bonds(Equilibrium&, ConstFieldView /*u*/, ConstFieldView /*r*/) { return false; }
  /// Bonds have failed, or are as before because a step was given up: a tangent that is kept is that of another body.
  virtual void bonds_changed() {}
};

/// Runs `problem` from its load parameter to 1. Planned steps are equal, end exactly at k/steps and start from the linear
/// continuation of the last one. A step that does not converge or meets an inadmissible deformation is halved, at most
/// `cut_backs` times; one that is too long for a law is shortened at once to the share that the law asks for. Every success doubles the step again, up to the planned one. Work of loads and prescribed
/// displacements by the trapezoidal rule.
/// With [damage] bonds fail at equilibria only, and then equilibrium is found again at the same load, until no more fail, or
/// those that did put the body out of balance by less than 1e-6 of the largest reference so far: then the step counts, in
/// equilibrium with the bonds it leaves. The first equilibrium that the solver finds to be unstable is told in a warning. What the body sets free on its way from one equilibrium to the next, bonds apart, would
/// become motion; a run without inertia counts it as dissipated. A step that is given up between two equilibria gives its bonds
/// back. Steps, the last increment and the load parameter are kept with the problem, so that a restored run continues to the bit.
/// Throws RunError when the smallest step fails, or bonds have failed bond_rounds times at one load, with load parameter, step
/// and reason.
void run_load_steps(std::string_view integrator, const LoadStepOptions& options, Problem& problem, Observer& observer, EquilibriumSolver& solver);

}  // namespace perikit
