#pragma once
/// Newton's method for the equilibrium of one load step; the linear systems are somebody else's.

#include <string>

#include "perikit/sdk/load_steps.hpp"

namespace perikit {

/// Solves K(u) du = rhs on the free components.
class LinearisedProblem {
 public:
  virtual ~LinearisedProblem() = default;
  /// The equations are those at u from now on. False where they cannot be set up; `failure` says why.
  virtual bool linearise(Equilibrium& equilibrium, ConstFieldView u, std::string& failure) = 0;
  /// Kw <- K w on free components, 0 elsewhere.
  virtual bool apply(Equilibrium& equilibrium, ConstFieldView w, FieldView Kw, std::string& failure) = 0;
  /// du (0 on entry and on prescribed components) with |K du - rhs| <= accuracy |rhs|. Adds what it has to say to `note`.
  virtual bool solve(Equilibrium& equilibrium, ConstFieldView rhs, double accuracy, FieldView du, std::string& note, std::string& failure) = 0;
  /// The accuracy to ask for where rhs is what prescribed motions of the rim alone push with, which may be far more than the reactions
  /// at the end of the step. Called after linearise.
  virtual double accuracy_for_motions(double accuracy) const { return accuracy; }
  /// True where solve() is as good as exact.
  virtual bool exact() const noexcept = 0;
  /// du, prescribed components included, is about to be added to u: it may become better than linear equations can be. Adds to `note`.
  virtual void refine(Equilibrium&, ConstFieldView /*u*/, FieldView /*du*/, std::string& /*note*/) {}
  /// Likewise of a du that continues the path from the equilibrium u of the last step. False where it stays as it is.
  virtual bool refine_extrapolation(Equilibrium&, ConstFieldView /*u*/, FieldView /*du*/, std::string& /*note*/) { return false; }
  /// See EquilibriumSolver, both.
  virtual bool unstable(Equilibrium&, ConstFieldView /*u*/, bool /*last*/) { return false; }
  virtual void bonds_changed() {}
};

/// Newton iteration [Hashim et al. eqs. 21-29, Partmann et al. eqs. 3.69-3.72]:
///   K(u) du = r(u) - K(u) w,   u <- u + alpha (du + w),   w = U - u on prescribed components, 0 elsewhere
/// so that the first increment carries prescribed displacements into the body instead of tearing its rim.
/// alpha = 1 unless u would be inadmissible. Residuals of slender bodies rise before they fall: full steps are taken until five of
/// them have neither given a new best residual nor halved the last one; then the iteration goes back to the best state and
/// asks every step to lower the residual (watchdog), halving alpha until it does.
/// Inexact solves take their accuracy from the last reduction [Eisenstat and Walker 1996, choice 2].
class NewtonIteration final : public EquilibriumSolver {
 public:
  NewtonIteration(LinearisedProblem& equations, std::int64_t max_iterations, bool line_search)
      : equations_(equations), max_iterations_(max_iterations), line_search_(line_search) {}
  Solution solve(Equilibrium& equilibrium, bool extrapolated) override;
  bool unstable(Equilibrium& equilibrium, ConstFieldView u, bool last) override { return equations_.unstable(equilibrium, u, last); }
  void bonds_changed() override { equations_.bonds_changed(); }

 private:
  LinearisedProblem& equations_;
  std::int64_t max_iterations_;
  bool line_search_;
};

}  // namespace perikit
