#pragma once
/// Equilibrium of a body at one load parameter: what a solver of quasi-static problems works on.

#include <chrono>
#include <string>
#include <string_view>
#include <utility>

#include "perikit/problem/integrator.hpp"
#include "perikit/problem/problem.hpp"

namespace perikit {

/// Residual, reference and prescribed displacements at one load parameter t. Fields have `dimension` components.
///
/// Convergence is relative [Hashim et al., eq. 26]: |r| <= tolerance * reference with r the out-of-balance force on the free
/// components and reference = sqrt(|external forces|^2 + |reactions|^2), Euclidean norms: under displacement control external
/// forces vanish and reactions do not. Where both vanish (a body moved rigidly), what rounding leaves counts as balanced:
/// the reference is at least 4 eps k |u| / tolerance with k the root-mean-square stiffness, |K w|/|w| of noise w.
class Equilibrium {
 public:
  /// Of `problem` to the relative `tolerance`.
  Equilibrium(Problem& problem, double tolerance);

  /// Loads and prescribed displacements are those at t from now on, to which a step of this length leads; `u` are the start values [m].
  void begin(double t, ConstFieldView u, double time_step = 0);

  Problem& problem() noexcept { return problem_; }
  double parameter() const noexcept { return t_; }
  /// Displacements u at the end of the present step.
  Configuration at(ConstFieldView u) const noexcept { return {u, t_, time_step_}; }
  double tolerance() const noexcept { return tolerance_; }
  /// Start values of the solver, then its answer [m]; suited for Problem::evaluate_forces. Prescribed components are those of the
  /// start until `impose`.
  FieldView displacement() noexcept { return u_; }
  ConstFieldView free() const noexcept { return free_; }

  /// Overwrites the prescribed components of u.
  void impose(FieldView u) { problem_.constraints().prescribe_displacement(t_, u); }
  /// w <- U(t) - u on prescribed components, 0 elsewhere; returns its largest magnitude [m].
  double missing(ConstFieldView u, FieldView w);

  /// r <- internal + external force on free components, 0 elsewhere [N]; the internal forces are kept in the problem, the strain energy
  /// goes to `energy` where wanted. False where u is inadmissible or r not finite; failure() then says why.
  bool residual(ConstFieldView u, FieldView r, double* energy = nullptr);
  /// |r| and |r|/reference of the last residual.
  double residual_norm() const noexcept { return norm_; }
  double relative_residual() const noexcept { return norm_ > 0 ? norm_ / reference_ : 0.0; }
  /// [N], of the last residual.
  double reference() const noexcept { return reference_; }
  bool converged() const noexcept { return norm_ <= tolerance_ * reference_; }
  const std::string& failure() const noexcept { return failure_; }

  /// Kw <- K(u) w on free components, 0 elsewhere [N]. False where u is inadmissible.
  bool tangent(ConstFieldView u, ConstFieldView w, FieldView Kw);

  /// From now on `observer` hears what is going on, and evaluations fail at once when it wants the run to end.
  void watch(Observer& observer) { observer_ = &observer; }
  /// Whether an evaluation failed because the run is to end.
  bool stopped() const noexcept { return stopped_; }
  /// The share of the step's length that a law asks for, for which the step is too long; 1: none has since `begin`.
  double step_factor() const noexcept { return step_factor_; }
  /// False where the run is to end, or the step is too long for a law: evaluations fail from now on, and what works without them, as factorisations do, is to be given up.
  bool goes_on();

  /// What the observer is told before each line of progress: "round 12, 340 bonds failed". Until the next one.
  void stage(std::string words) { stage_ = std::move(words); }
  /// A line for run.log; lines of one step are written together, or every few seconds where it takes longer.
  void note(std::string_view line);
  std::string take_notes();

 private:
  Problem& problem_;
  Observer* observer_ = nullptr;
  bool stopped_ = false;
  double step_factor_ = 1;
  std::string last_note_, stage_;
  std::int64_t actions_ = 0;   ///< of the tangent since the last note
  std::chrono::steady_clock::time_point logged_ = std::chrono::steady_clock::now();
  double tolerance_;
  double t_ = 0, time_step_ = 0, norm_ = 0, reference_ = 0, stiffness_ = 0;
  Field u_, scratch_;
  ConstFieldView free_;
  FieldView external_;   ///< no data without loads
  std::string failure_, notes_;
};

}  // namespace perikit
