#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "perikit/sdk/plugin.hpp"

using namespace perikit;

namespace {

/// Work of loads and constraints, step by step [J]. What a constraint puts in is the change of kinetic energy of the prescribed components
/// less the work of the other forces on them.
class Work {
 public:
  explicit Work(Problem& problem) : problem_(problem), old_load_(problem.make_field(problem.dimension())), scratch_(problem.make_field(problem.dimension())) {
    if (problem.any_load()) problem.evaluate_loads(problem.time(), problem.external_force());
    speed_ = prescribed_speed();
  }

  /// Before the displacements of a step move.
  void begin() {
    if (problem_.any_load()) std::copy_n(problem_.external_force().data, old_load_.size(), old_load_.data());
    force_.clear();
    for (const std::int64_t dof : problem_.constrained()) force_.push_back(total_force(dof));
  }
  /// After the forces of its end are there.
  void end(double dt, ConstFieldView half_step_velocity) {
    double work = 0;
    if (problem_.any_load()) {
      const FieldView load = problem_.external_force();
      problem_.evaluate_loads(problem_.time(), load);
      for (std::size_t k = 0; k < load.size(); ++k) work += 0.5 * (load.data[k] + old_load_.data()[k]) * dt * half_step_velocity.data[k];
    }
    const std::vector<double> now = prescribed_speed();
    const auto dofs = problem_.constrained();
    for (std::size_t k = 0; k < dofs.size(); ++k) {
      const double mass = problem_.mass()[static_cast<std::size_t>(dofs[k]) % problem_.stride()];
      work += 0.5 * mass * (now[k] * now[k] - speed_[k] * speed_[k]) - 0.5 * (force_[k] + total_force(dofs[k])) * dt * half_step_velocity.data[dofs[k]];
    }
    speed_ = now;
    problem_.energies().external_work += work;
  }

 private:
  double total_force(std::int64_t dof) { return problem_.internal_force().data[dof] + (problem_.any_load() ? problem_.external_force().data[dof] : 0.0); }
  std::vector<double> prescribed_speed() {
    if (problem_.any_constraint()) problem_.prescribe_velocity(problem_.time(), scratch_);
    std::vector<double> speed;
    for (const std::int64_t dof : problem_.constrained()) speed.push_back(scratch_.data()[dof]);
    return speed;
  }

  Problem& problem_;
  Field old_load_, scratch_;
  std::vector<double> speed_, force_;   ///< by constrained component
};

/// YOUR PHYSICS: how the state gets from one step to the next. Default: velocity Verlet,
///   v(t + dt/2) = v(t - dt/2) + dt a(t),  u(t + dt) = u(t) + dt v(t + dt/2),  a = (internal + external force)/mass.
class PartName final : public Integrator {
 public:
  PartName(double end_time, double time_step) : end_time_(end_time), time_step_(time_step) {}

  IntegratorTraits traits() const noexcept override { return {.dynamic = true, .quasi_static = false}; }

  std::string plan(Problem& problem) override { return fmt::format("{:.0f} steps to {:.4g} s", steps(problem), end_time_); }

  void run(Problem& problem, Observer& observer) override {
    // Every run variable is declared at the problem, not kept in this object: checkpoints then hold it, and a run goes on bitwise.
    std::span<double> numbers = problem.declare_numbers("part_name", 2);
    double& count = numbers[0];     // of steps; 0 before the start
    double& last_dt = numbers[1];   // 0 before the first step
    const FieldView u = problem.displacement(), v = problem.velocity(), half = problem.declare("half_step_velocity", problem.dimension());
    Work work(problem);
    const auto report = [&] {
      return StepReport{.step = problem.step(), .time = problem.time(), .time_step = end_time_ / count, .end_time = end_time_,
                        .steps_expected = static_cast<std::int64_t>(count)};
    };
    if (count == 0) {
      count = steps(problem);
      if (problem.any_constraint()) problem.prescribe_velocity(problem.time(), v);
      evaluate(problem, observer.wants_sample(0, problem.time()), end_time_ / count);
      std::copy_n(v.data, v.size(), half.data);
      observer.step_done(report());
    }
    const double dt = end_time_ / count;
    while (static_cast<double>(problem.step()) < count && !observer.cancelled()) {
      const double t = problem.time(), t_next = end_time_ * (static_cast<double>(problem.step() + 1) / count);
      work.begin();
      kick(problem, half, half, 0.5 * (last_dt + dt));
      if (problem.any_constraint()) problem.prescribe_half_step_velocity(t, t_next, half);
      for (std::size_t k = 0; k < u.size(); ++k) u.data[k] += dt * half.data[k];
      problem.time() = t_next;
      ++problem.step();
      const bool sample = observer.wants_sample(problem.step(), t_next);
      evaluate(problem, sample, dt);
      work.end(dt, half);
      last_dt = dt;
      if (sample) {   // velocities at full steps are only wanted here
        kick(problem, half, v, 0.5 * dt);
        if (problem.any_constraint()) problem.prescribe_velocity(t_next, v);
      }
      problem.advance_history(dt);
      observer.step_done(report());
    }
  }

 private:
  double steps(Problem& problem) const {
    constexpr double safety = 0.9;
    const double dt = time_step_ > 0 ? time_step_ : safety * 2 / std::sqrt(problem.largest_eigenvalue(problem.displacement()));
    return std::max(1.0, std::ceil(end_time_ / dt * (1 - 1e-12)));
  }

  static void evaluate(Problem& problem, bool energy, double dt) {
    const EvaluationStatus status = problem.evaluate_forces(problem.displacement(), problem.internal_force(), energy ? &problem.energies().strain : nullptr, dt);
    if (!status.ok()) throw RunError(fmt::format("step {}, time {:.6g} s: {}", problem.step(), problem.time(), status.description));
  }

  /// to = from + dt a.
  static void kick(Problem& problem, ConstFieldView from, FieldView to, double dt) {
    const auto mass = problem.mass();
    const FieldView internal = problem.internal_force(), external = problem.any_load() ? problem.external_force() : FieldView{};
    for (std::size_t k = 0; k < to.size(); ++k) {
      const double m = mass[k % problem.stride()];   // 0 at points that only pad the arrays
      const double force = internal.data[k] + (external.data ? external.data[k] : 0.0);
      to.data[k] = from.data[k] + (m > 0 ? dt * force / m : 0.0);
    }
  }

  double end_time_, time_step_;
};

ParameterTable parameters() {
  ParameterTable table;
  table.number("end_time", "s", "End of the run; hit exactly by equal steps.").require().positive();
  table.number("time_step", "s", "Largest step; found from the stiffness at the start where it is not given.").positive();
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
                       [](const ParameterValues& values, const PartFactory&) {
                         return std::make_unique<PartName>(values.number("end_time"), values.has("time_step") ? values.number("time_step") : 0.0);
                       });
}
