#include "perikit/sdk/newton_iteration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "perikit/core/field_operations.hpp"

namespace perikit {

namespace {

constexpr int patience = 5;                  // iterations that neither give a new best residual nor halve the last one
constexpr double least_fraction = 1.0 / 16;  // of a Newton step; where less is needed, a shorter load step leads further
constexpr double sufficient = 1e-4;          // Armijo's share of the linear decrease

/// Accuracy of the next linear solve [Eisenstat and Walker 1996, choice 2, with their safeguard].
double forcing(double last, double residual, double last_residual, double target) {
  constexpr double gamma = 0.9, most = 1e-2;
  if (last_residual <= 0) return 1e-3;
  double accuracy = gamma * (residual / last_residual) * (residual / last_residual);
  if (gamma * last * last > 0.1) accuracy = std::max(accuracy, gamma * last * last);
  return std::max(std::min(accuracy, most), std::min(0.3, 0.3 * target / residual));
}

/// One solve: the state and the iteration on it.
class Iteration {
 public:
  Iteration(Equilibrium& equilibrium, LinearisedProblem& equations)
      : equilibrium_(equilibrium), equations_(equations), u_(equilibrium.displacement()), r_(make()), trial_(make()), du_(make()),
        missing_(make()), action_(make()) {}

  bool start(bool extrapolated, std::string& note, std::string& failure) {
    if (extrapolated) {
      const ConstFieldView last = equilibrium_.problem().state().displacement();
      combine(1, u_, -1, last, du_);
      if (equations_.refine_extrapolation(equilibrium_, last, du_, note)) combine(1, last, 1, du_, u_);
    }
    // What is missing of the prescribed displacements only by rounding, or by a good continuation, is set at once.
    gap_ = equilibrium_.missing(u_, missing_);
    if (gap_ <= 1e-6 * largest_magnitude(u_)) impose(u_);
    if (equilibrium_.residual(u_, r_)) return true;
    failure = equilibrium_.failure();
    return false;
  }

  bool done() const noexcept { return gap_ == 0 && equilibrium_.converged(); }
  bool imposed() const noexcept { return gap_ == 0; }

  /// du_ <- the increment of this iteration.
  bool direction(double accuracy, std::string& note, std::string& failure) {
    if (!equations_.linearise(equilibrium_, u_, failure)) return false;
    if (gap_ > 0) {
      equilibrium_.missing(u_, missing_);
      if (!equations_.apply(equilibrium_, missing_, action_, failure)) return false;
      combine(1, r_, -1, action_, r_);
      accuracy = equations_.accuracy_for_motions(accuracy);
    }
    fill(0.0, du_);
    if (!equations_.solve(equilibrium_, r_, accuracy, du_, note, failure)) return false;
    if (gap_ > 0) combine(1, du_, 1, missing_, du_);
    equations_.refine(equilibrium_, u_, du_, note);
    return true;
  }

  /// u + alpha du, evaluated. The residual is that of the trial afterwards.
  bool evaluate_trial(double alpha) {
    combine(1, u_, alpha, du_, trial_);
    if (alpha == 1.0) equilibrium_.impose(trial_);
    return equilibrium_.residual(trial_, r_);
  }

  void accept(double alpha) {
    copy(trial_, u_);
    if (alpha == 1.0) gap_ = 0;
    else if (gap_ > 0) gap_ = equilibrium_.missing(u_, missing_);
  }

  bool go_to(ConstFieldView u) {
    copy(u, u_);
    return equilibrium_.residual(u_, r_);
  }

  ConstFieldView displacement() const noexcept { return u_; }
  Field make() const { return equilibrium_.problem().make_field(); }

 private:
  void impose(FieldView u) {
    equilibrium_.impose(u);
    gap_ = 0;
  }

  Equilibrium& equilibrium_;
  LinearisedProblem& equations_;
  FieldView u_;
  Field r_, trial_, du_, missing_, action_;
  double gap_ = 0;   ///< largest prescribed displacement that u still misses [m]
};

}  // namespace

Solution NewtonIteration::solve(Equilibrium& equilibrium, bool extrapolated) {
  Solution solution;
  Iteration iteration(equilibrium, equations_);
  std::string of_start;
  if (!iteration.start(extrapolated, of_start, solution.failure)) return solution;
  const auto note = [&](double alpha, const std::string& more) {
    equilibrium.note(fmt::format("  iteration {:2}  residual {:.3e}{}{}", solution.iterations, equilibrium.relative_residual(),
                                 alpha < 1 ? fmt::format("  {:.3g} of the step", alpha) : "", more));
  };
  note(1, of_start);
  Field best_u = iteration.make();
  double best = 0, last_residual = 0, accuracy = 0;
  int since_best = 0;
  bool strict = false, any_best = false;
  while (!iteration.done()) {
    if (solution.iterations >= max_iterations_) {
      solution.failure = fmt::format("the residual is {:.3g} (tolerance {:.3g}) after {} iterations", equilibrium.relative_residual(), equilibrium.tolerance(), solution.iterations);
      return solution;
    }
    const double residual = equilibrium.residual_norm();
    const bool imposed = iteration.imposed();
    if (imposed && (!any_best || residual < best)) {
      any_best = true;
      best = residual;
      since_best = 0;
      if (line_search_) copy(iteration.displacement(), best_u);
    } else if (imposed && residual > 0.5 * last_residual && ++since_best >= patience && line_search_ && !strict) {
      strict = true;
      if (!iteration.go_to(best_u)) break;
      equilibrium.note("  back to the best state; from here every step lowers the residual");
      continue;
    }
    accuracy = equations_.exact() ? 0.0 : forcing(accuracy, residual, imposed ? last_residual : 0.0, equilibrium.tolerance() * equilibrium.reference());
    last_residual = imposed ? residual : 0.0;
    ++solution.iterations;
    std::string more;
    if (!iteration.direction(accuracy, more, solution.failure)) return solution;
    double alpha = 1;
    const auto acceptable = [&] {
      if (!iteration.evaluate_trial(alpha)) return false;
      return !(strict && imposed) || equilibrium.residual_norm() <= (1 - sufficient * alpha) * residual || equilibrium.converged();
    };
    while (!acceptable()) {
      alpha /= 2;
      if (!line_search_ || alpha < least_fraction) {
        solution.failure = strict ? "no part of a Newton step lowers the residual" : equilibrium.failure();
        return solution;
      }
    }
    iteration.accept(alpha);
    note(alpha, more);
  }
  solution.converged = iteration.done();
  return solution;
}

}  // namespace perikit
