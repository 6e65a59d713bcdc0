#pragma once
/// Integrators run a Problem and report to an Observer.

#include <cstdint>
#include <string>
#include <string_view>

namespace perikit {

class Problem;

/// What an integrator tells after every finished step.
struct StepReport {
  std::int64_t step = 0;           ///< 0 for the initial state
  double time = 0;                 ///< [s], or the load parameter in [0, 1]
  double time_step = 0;
  int iterations = 0;              ///< of the nonlinear solver, 0 for explicit steps
  double residual = 0;             ///< relative, 0 for explicit steps
  double end_time = 0;
  std::int64_t steps_expected = 0; ///< 0: unknown
};

class Observer {
 public:
  virtual ~Observer() = default;
  /// Asked once before every step_done: true when the state after this step will be sampled, so that energies, work and velocity
  /// must be up to date when step_done is called.
  virtual bool wants_sample(std::int64_t step, double time) = 0;
  /// Called after every step (and once with step 0). May write frames and history.
  virtual void step_done(const StepReport& report) = 0;
  /// A line for run.log.
  virtual void log(std::string_view message) = 0;
  /// True when the run should end after this step.
  virtual bool cancelled() const noexcept { return false; }

  // For integrators whose steps take long.
  /// What an integrator is at within a step, told again and again.
  virtual void working(std::string_view /*what*/) {}
  /// True when the run should end within this step: the integrator then calls `stopped_within_step` and returns.
  virtual bool interrupted() const noexcept { return false; }
  /// The present step is given up. The observer puts the problem back to where the last `step_done` found it.
  virtual void stopped_within_step() {}
};

struct IntegratorTraits {
  bool dynamic = false;       ///< needs densities; writes velocity
  bool quasi_static = false;  ///< time is a load parameter in [0, 1]; values of boundaries and loads that do not mention t ramp
  /// Runs where each of several ranks has a part of the body: it asks for no assembled tangent, and what it sums over points goes
  /// through the operations on fields or `total_over_ranks`.
  bool several_ranks = false;
};

class Integrator {
 public:
  virtual ~Integrator() = default;
  virtual IntegratorTraits traits() const noexcept = 0;
  /// What `perikit check` prints: "12 000 steps of 1.2e-7 s". May evaluate the tangent.
  virtual std::string plan(Problem&) { return {}; }
  /// What the run takes beyond the problem itself: matrices, factors, vectors [bytes]. `perikit check` prints it; a run that the machine has no memory
  /// for is refused before it writes or allocates anything.
  virtual double memory(Problem&) { return 0; }
  /// Runs from the problem's present state, which may be one that `restore` brought back, to the end. Throws RunError.
  virtual void run(Problem&, Observer&) = 0;
};

}  // namespace perikit
