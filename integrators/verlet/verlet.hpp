#pragma once
#include "perikit/integrator.hpp"

namespace perikit {

struct VerletOptions {
  double end_time = 0;             ///< [s]
  double time_step = 0;            ///< [s]; 0: estimated
  double safety = 0;               ///< to the estimated stable step; 0: found
  bool bond_based = false;         ///< estimate by P 3.58, at most the stable step
  std::int64_t check_every = 500;  ///< steps between estimates of a nonlinear body
  ParameterValues values{};        ///< where they come from, for messages
};

/// Velocity Verlet [Partmann et al. 3.60-3.68] in its half-step form: v(t + dt/2) = v(t - dt/2) + dt a(t), u += dt v(t + dt/2).
/// Velocities at full steps, v(t) = v(t - dt/2) + dt/2 a(t), are formed where a sample is taken.
class Verlet final : public Integrator {
 public:
  explicit Verlet(const VerletOptions& options) : options_(options) {}
  IntegratorTraits traits() const noexcept override { return {.dynamic = true, .quasi_static = false, .several_ranks = true}; }
  std::string plan(Problem& problem) override;
  void run(Problem& problem, Observer& observer) override;

 private:
  /// 0.9; half of the stable step where bonds may fail: what a crack takes per area is then within a few per cent of small steps.
  double safety(const Problem& problem) const;
  /// The step to take where this is the largest eigenvalue: this share of the stable one.
  double step_of(const Problem& problem, double share, double eigenvalue) const;
  double beside_resonance(double step, double softest) const;
  /// The largest eigenvalue around the bonds that failed in the last step; 0 where it lies below `most`.
  double eigenvalue_around_failed_bonds(Problem& problem, double most) const;
  /// A warning where the bond-based estimate, asked for, is longer than the stable step of the beginning; else empty.
  std::string bond_based_doubt(const Problem& problem) const;
  /// That of the beginning, estimated once for plan() and run(), which take it of the same displacement.
  double first_step(Problem& problem);
  /// Equal steps of at most `step` from `time` to the end. Throws InputError for more than can be counted.
  double steps_to_end(double time, double step) const;
  VerletOptions options_;
  struct {
    const Problem* problem = nullptr;   ///< null: not estimated
    double eigenvalue = 0;              ///< [1/s^2]
    std::vector<double> displacement;   ///< for which it was
  } planned_;
};

}  // namespace perikit
