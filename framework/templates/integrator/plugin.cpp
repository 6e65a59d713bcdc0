#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "perikit/integrator.hpp"
#include "perikit/sdk/stable_step.hpp"

using namespace perikit;

namespace {

/// Work of loads and constraints, step by step [J]. What a constraint puts in is the change of kinetic energy of the prescribed components
/// less the work of the other forces on them.
class Work {
 public:
  explicit Work(Problem& problem)
      : state_(problem.state()), constraints_(problem.constraints()), loads_(problem.loads()), mass_(problem.masses().by_point()),
        old_load_(problem.make_field()), scratch_(problem.make_field()) {
    loads_.evaluate(state_.time, state_.external_force());
    speed_ = prescribed_speed();
  }

  /// Before the displacements of a step move.
  void begin() {
    std::copy_n(state_.external_force().data, old_load_.size(), old_load_.data());
    force_.clear();
    for (const std::int64_t dof : constraints_.dofs()) force_.push_back(total_force(dof));
  }
  /// After the forces of its end are there.
  void end(double dt, ConstFieldView half_step_velocity) {
    double work = 0;
    const FieldView load = state_.external_force();
    loads_.evaluate(state_.time, load);
    for (std::size_t k = 0; k < load.size(); ++k) work += 0.5 * (load.data[k] + old_load_.data()[k]) * dt * half_step_velocity.data[k];
    const std::vector<double> now = prescribed_speed();
    const auto dofs = constraints_.dofs();
    for (std::size_t k = 0; k < dofs.size(); ++k) {
      const double mass = mass_[static_cast<std::size_t>(dofs[k]) % load.stride];
      work += 0.5 * mass * (now[k] * now[k] - speed_[k] * speed_[k]);
      work -= 0.5 * (force_[k] + total_force(dofs[k])) * dt * half_step_velocity.data[dofs[k]];
    }
    speed_ = now;
    state_.energies.external_work += work;
  }

 private:
  double total_force(std::int64_t dof) { return state_.internal_force().data[dof] + state_.external_force().data[dof]; }
  std::vector<double> prescribed_speed() {
    constraints_.prescribe_velocity(state_.time, scratch_);
    std::vector<double> speed;
    for (const std::int64_t dof : constraints_.dofs()) speed.push_back(scratch_.data()[dof]);
    return speed;
  }

  State& state_;
  const Constraints& constraints_;
  const Loads& loads_;
  std::span<const double> mass_;
  Field old_load_, scratch_;
  std::vector<double> speed_, force_;   ///< by constrained component
};

/// YOUR PHYSICS: how the state gets from one step to the next. Default: velocity Verlet,
///   v(t + dt/2) = v(t - dt/2) + dt a(t),  u(t + dt) = u(t) + dt v(t + dt/2),  a = (internal + external force)/mass.
class PartName final : public Integrator {
 public:
  explicit PartName(const ParameterValues& values)
      : values_(values),
        end_time_(values.number("end_time")),
        time_step_(values.has("time_step") ? values.number("time_step") : 0.0) {}

  IntegratorTraits traits() const noexcept override { return {.dynamic = true, .quasi_static = false}; }

  std::string plan(Problem& problem) override {
    check_time_step(problem, values_);
    return fmt::format("{:.0f} steps to {:.4g} s", steps(problem), end_time_);
  }

  void run(Problem& problem, Observer& observer) override {
    State& state = problem.state();
    Constraints& constraints = problem.constraints();
    // Every run variable is declared in the state, not kept in this object: checkpoints then hold it, and a run goes on bitwise.
    std::span<double> numbers = state.declare_numbers("part_name", 2);
    double& count = numbers[0];     // of steps; 0 before the start
    double& last_dt = numbers[1];   // 0 before the first step
    const FieldView u = state.displacement(), v = state.velocity(), half = state.declare("half_step_velocity");
    Work work(problem);
    const auto report = [&] {
      return StepReport{.step = state.step, .time = state.time, .time_step = end_time_ / count, .end_time = end_time_,
                        .steps_expected = static_cast<std::int64_t>(count)};
    };
    if (count == 0) {
      check_time_step(problem, values_, &observer);
      count = steps(problem);
      constraints.prescribe_velocity(state.time, v);
      evaluate(problem, observer.wants_sample(0, state.time), end_time_ / count, v);
      std::copy_n(v.data, v.size(), half.data);
      observer.step_done(report());
    }
    const double dt = end_time_ / count;
    while (static_cast<double>(state.step) < count && !observer.cancelled()) {
      const double t = state.time, t_next = end_time_ * (static_cast<double>(state.step + 1) / count);
      work.begin();
      kick(problem, half, half, 0.5 * (last_dt + dt));
      constraints.prescribe_half_step_velocity(t, t_next, u, half);
      for (std::size_t k = 0; k < u.size(); ++k) u.data[k] += dt * half.data[k];
      state.time = t_next;
      ++state.step;
      const bool sample = observer.wants_sample(state.step, t_next);
      evaluate(problem, sample, dt, half);
      work.end(dt, half);
      last_dt = dt;
      if (sample) {   // velocities at full steps are only wanted here
        kick(problem, half, v, 0.5 * dt);
        constraints.prescribe_velocity(t_next, v);
      }
      problem.advance(dt);
      observer.step_done(report());
    }
  }

 private:
  double steps(Problem& problem) const {
    constexpr double safety = 0.9;
    const double dt = time_step_ > 0 ? time_step_ : safety * 2 / std::sqrt(largest_eigenvalue(problem, problem.state().displacement()));
    return std::max(1.0, std::ceil(end_time_ / dt * (1 - 1e-12)));
  }

  static void evaluate(Problem& problem, bool energy, double dt, ConstFieldView half_step_velocity) {
    State& state = problem.state();
    double* const strain = energy ? &state.energies.strain : nullptr;
    const EvaluationStatus status = problem.evaluate_forces({state.displacement(), state.time, dt, half_step_velocity}, state.internal_force(), strain);
    if (!status.ok()) throw RunError(fmt::format("step {}, time {:.6g} s: {}", state.step, state.time, status.description));
  }

  /// to = from + dt a.
  static void kick(Problem& problem, ConstFieldView from, FieldView to, double dt) {
    const auto mass = problem.masses().by_point();
    const FieldView internal = problem.state().internal_force(), external = problem.state().external_force();
    for (std::size_t k = 0; k < to.size(); ++k) {
      const double m = mass[k % to.stride];   // 0 at points that only pad the arrays
      to.data[k] = from.data[k] + (m > 0 ? dt * (internal.data[k] + external.data[k]) / m : 0.0);
    }
  }

  ParameterValues values_;
  double end_time_, time_step_;
};

ParameterTable parameters() {
  ParameterTable table;
  table.number("end_time", "s", "End of the run; hit exactly by equal steps.").require().positive();
  table.number("time_step", "s", "Largest step; found from the stiffness at the start where it is not given.").positive();
  allow_unstable_parameter(table);
  return table;
}

}  // namespace

PERIKIT_PLUGIN(registrar) {
  registrar.integrator({.name = "part_name",
                        .summary = "one line: what it is",
                        .parameters = parameters(),
                        // Every example is built and tested by the contract suite.
                        .examples = {"end_time = 1.0e-4", "end_time = 1.0e-4\ntime_step = 1.0e-6"},
                        .equations = "v(t+dt/2) = v(t-dt/2) + dt a(t), u(t+dt) = u(t) + dt v(t+dt/2)",
                        .source = "the paper, with the number of the equation",
                        .limits = "the step is estimated once: not for bodies that become stiffer"},
                       [](const ParameterValues& values, const PartFactory&) { return std::make_unique<PartName>(values); });
}
