#include "verlet.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "perikit/core/communicator.hpp"
#include "perikit/core/field_operations.hpp"
#include "perikit/core/point_motion.hpp"
#include "perikit/core/simd.hpp"
#include "perikit/core/warnings.hpp"
#include "perikit/sdk/stable_step.hpp"
#include "stretch_watch.hpp"

namespace perikit {

namespace {

/// The run's loop variables: where the force of the last step is, and what happens to prescribed and loaded points. As a motion it kicks points and
/// lets them drift.
class Stepper final : private PointMotion {
 public:
  /// goes_on: the state has the loads of its last step. They act on the surface as it was before bonds failed in that step.
  Stepper(Problem& problem, bool goes_on)
      : PointMotion(problem.points().stride()),
        problem_(problem),
        state_(problem.state()),
        constraints_(problem.constraints()),
        u_(state_.displacement()),
        v_(state_.declare("half_step_velocity")),
        force_(state_.internal_force()),
        mass_(problem.masses().by_point().data()),
        uniform_(problem.masses().uniform()),
        loaded_(problem.loads().any()),
        external_(loaded_ ? state_.external_force() : FieldView{}) {
    if (loaded_ && !goes_on) load();
  }

  /// Loads at the present state.
  void load() {
    const EvaluationStatus status = problem_.external_forces(problem_.configuration(), external_);
    if (!status.ok())
      throw RunError(
          fmt::format("step {}, time {:.6g} s: loads that follow the surface: {}", state_.step, state_.time, status.description));
  }

  /// Forces after the motion that `advance` has left to it; without one, at the present displacements.
  void evaluate(double* energy, double dt) {
    const Configuration at(u_, state_.time, dt, v_);
    const EvaluationStatus status = problem_.evaluate_forces(pending() ? at.moving(*this) : at, force_, energy);
    if (!status.ok())
      throw RunError(fmt::format("step {}, time {:.6g} s: {}{}", state_.step, state_.time, status.description,
                                 status.step_factor < 1 ? "; verlet takes no step again: a shorter time_step, or a smaller safety, may do" : ""));
  }

  /// target = v + dt a with v at half steps, on all points.
  void kick(FieldView target, double dt) {
    over_blocks(u_.stride, [&](std::size_t begin, std::size_t end) {
      kick(target, dt, begin, end, [](int) { return [](std::size_t, Pack) {}; });
    });
  }

  /// The next evaluation begins with kick and drift; prescribed components move as prescribed.
  void advance(double kick_dt, double dt, double t, double t_next) {
    kick_dt_ = kick_dt;
    dt_ = dt;
    constraints_.prescribe_half_step_velocity(t, t_next, u_, v_);
    const auto dofs = constraints_.dofs();
    if (before_.size() != dofs.size()) sort_held();
    for (std::size_t k = 0; k < dofs.size(); ++k) before_[k] = total_force(dofs[k]);
    for (Held& held : held_) {
      held.v = v_.data[held.dof];
      held.u = u_.data[held.dof] + dt * held.v;
    }
    expect();
  }

  /// Work of the loads over a step of length dt that ended now [J].
  void add_work_of_loads(double dt, ConstFieldView old_external) {
    if (!loaded_) return;
    const double now = dot(external_, v_);
    state_.energies.external_work += dt * (old_external.data ? 0.5 * (now + dot(old_external, v_)) : now);
  }

  /// That of the constraints: what keeps the energy of the prescribed components in balance, their change of kinetic energy less
  /// the work of the other forces on them.
  void add_work_of_constraints(double dt) {
    ExactSum held;
    const auto dofs = constraints_.dofs();
    for (std::size_t k = 0; k < dofs.size(); ++k) {
      const double m = mass_[point_of(dofs[k])], now = full_[k];
      held.add(0.5 * m * (now * now - speed_[k] * speed_[k]) - 0.5 * (before_[k] + total_force(dofs[k])) * dt * v_.data[dofs[k]]);
      speed_[k] = now;
    }
    state_.energies.external_work += total_over_ranks(held);
  }

  /// Velocities of the prescribed components at full step t.
  void prescribed_speed(double t, FieldView scratch) {
    if (!constraints_.any()) return;
    constraints_.prescribe_velocity(t, scratch);
    const auto dofs = constraints_.dofs();
    full_.resize(dofs.size());
    for (std::size_t k = 0; k < dofs.size(); ++k) full_[k] = scratch.data[dofs[k]];
  }
  void start_speed() { speed_ = full_; }

  FieldView half() const noexcept { return v_; }
  FieldView external() const noexcept { return external_; }
  bool loaded() const noexcept { return loaded_; }

 private:
  /// A prescribed component, and what it is at the end of the step.
  struct Held {
    std::int64_t dof;
    double u, v;
  };

  /// By point, so that those of a piece follow each other.
  void sort_held() {
    before_.resize(constraints_.dofs().size());
    for (const std::int64_t dof : constraints_.dofs()) held_.push_back({dof, 0, 0});
    std::ranges::sort(held_, {}, [&](const Held& held) { return point_of(held.dof); });
  }
  std::size_t point_of(std::int64_t dof) const noexcept { return static_cast<std::size_t>(dof) % u_.stride; }

  /// target = v + dt a on the points [begin, end); then(c)(p, target) by component and pack.
  template <class Then>
  void kick(FieldView target, double dt, std::size_t begin, std::size_t end, const Then& then) const {
    const double* masses = uniform_ > 0 ? nullptr : mass_;
    const auto per_mass = [dt](Pack m) { return select(m > Pack(0.0), Pack(dt) / m, Pack(0.0)); };
    const Pack everywhere = per_mass(Pack(uniform_));
    for (int c = 0; c < u_.components; ++c) {
      const double* f = force_.component(c);
      const double* e = loaded_ ? external_.component(c) : nullptr;
      const double* from = v_.component(c);
      double* to = target.component(c);
      const auto then_of = then(c);
      for (std::size_t p = begin; p < end; p += pack_width) {
        const Pack total = e ? Pack::load(f + p) + Pack::load(e + p) : Pack::load(f + p);
        const Pack factor = masses ? per_mass(Pack::load(masses + p)) : everywhere;
        const Pack v = Pack::load(from + p) + factor * total;
        v.store(to + p);
        then_of(p, v);
      }
    }
  }

  void move(std::size_t begin, std::size_t end) noexcept override {
    kick(v_, kick_dt_, begin, end, [&](int c) {
      return [u = u_.component(c), f = force_.component(c), dt = Pack(dt_)](std::size_t p, Pack v) {
        (Pack::load(u + p) + dt * v).store(u + p);
        Pack(0.0).store(f + p);
      };
    });
    for (auto held = std::ranges::lower_bound(held_, begin, {}, [&](const Held& h) { return point_of(h.dof); });
         held != held_.end() && point_of(held->dof) < end; ++held) {
      v_.data[held->dof] = held->v;
      u_.data[held->dof] = held->u;
    }
  }

  double total_force(std::int64_t dof) const noexcept { return force_.data[dof] + (loaded_ ? external_.data[dof] : 0.0); }

  Problem& problem_;
  State& state_;
  Constraints& constraints_;
  FieldView u_, v_, force_;
  const double* mass_;
  double uniform_;
  bool loaded_;
  FieldView external_;
  double kick_dt_ = 0, dt_ = 0;   ///< of the next motion
  std::vector<Held> held_;
  std::vector<double> before_, speed_, full_;   ///< by constrained component
};

}  // namespace

double Verlet::safety(const Problem& problem) const {
  return options_.safety > 0 ? options_.safety : problem.bonds().empty() ? 0.9 : 0.5;
}

double Verlet::step_of(const Problem& problem, double share, double eigenvalue) const {
  const double step = eigenvalue > 0 ? share * 2 / std::sqrt(eigenvalue) : options_.end_time;
  return options_.bond_based ? std::min(step, share * bond_based_time_step(problem.body(), problem.laws())) : step;
}

/// A step after the first one: `step`, unless its share of the stable step of the softest state lies in the band of resonance, which it is then shortened to leave.
/// Verlet gives the fastest motion of the body a period of three steps where the step is sqrt(3)/2 = 0.866 of the stable one. There each nonlinearity of the
/// forces feeds that motion (resonance of the third order), until a corner of the body turns inside out.
double Verlet::beside_resonance(double step, double softest) const {
  constexpr double least = 0.855, largest = 0.885;   // measured (README.md)
  if (!(softest > 0)) return step;
  const double stable = 2 / std::sqrt(softest), share = step / stable;
  return share > least && share < largest ? least * stable : step;
}

double Verlet::eigenvalue_around_failed_bonds(Problem& problem, double most) const {
  const std::unique_ptr<DamagedPart> part = problem.damaged_part();
  if (!part) return 0;
  const double found = largest_eigenvalue(problem, *part, problem.state().displacement(), most);
  return found < most ? 0 : found;
}

double Verlet::steps_to_end(double time, double step) const {
  constexpr double most = 1e15;   // whole numbers that a double holds
  const double steps = std::max(1.0, std::ceil((options_.end_time - time) / step * (1 - 1e-12)));
  if (steps <= most) return steps;
  throw options_.values.error("end_time", fmt::format("found {} s, which is {:.3g} steps of {:.3g} s; allowed: at most {:.0e} steps",
                                                      options_.end_time, steps, step, most));
}

double Verlet::first_step(Problem& problem) {
  if (options_.time_step > 0) return options_.time_step;
  const ConstFieldView u = problem.state().displacement();
  if (planned_.problem != &problem || !std::equal(u.data, u.data + u.size(), planned_.displacement.begin(), planned_.displacement.end()))
    planned_ = {&problem, largest_eigenvalue(problem, u), {u.data, u.data + u.size()}};
  return step_of(problem, safety(problem), planned_.eigenvalue);
}

std::string Verlet::plan(Problem& problem) {
  check_time_step(problem, options_.values);
  const double dt = first_step(problem);
  const double steps = steps_to_end(0, dt);
  const std::string doubt = bond_based_doubt(problem);
  return fmt::format("{:.0f} steps of {:.4g} s to {:.4g} s (bond-based estimate of the stable step, P 3.58: {:.4g} s){}{}", steps,
                     options_.end_time / steps, options_.end_time, bond_based_time_step(problem.body(), problem.laws()), doubt.empty() ? "" : "; ", doubt);
}

std::string Verlet::bond_based_doubt(const Problem& problem) const {
  if (!options_.bond_based || options_.time_step > 0 || !(planned_.eigenvalue > 0)) return {};
  const double estimate = bond_based_time_step(problem.body(), problem.laws()), stable = 2 / std::sqrt(planned_.eigenvalue);
  if (estimate <= stable) return {};
  return fmt::format("the bond-based estimate of the stable step, {:.4g} s, is longer than the longest stable step at the start, {:.4g} s, which is "
                     "taken in its place",
                     estimate, stable);
}

void Verlet::run(Problem& problem, Observer& observer) {
  State& state = problem.state();
  // Equal steps that hit the end exactly; times are computed from step numbers, so that no rounding accumulates.
  const std::span<double> plan = state.declare_numbers("verlet_plan", 6);
  double& first = plan[0];     // step at which the plan was made
  double& start = plan[1];     // and its time
  double& dt = plan[2];
  double& last_dt = plan[3];
  double& counter = plan[4];   // steps of the plan
  double& softest = plan[5];   // the least eigenvalue of the body so far
  // An estimate that a signal ended is made up for when the run goes on: whether one is due, whether after a stretch, and the eigenvalue around failed bonds.
  const std::span<double> asked = state.declare_numbers("verlet_estimate", 3);
  double &due = asked[0], &stretched = asked[1], &failed = asked[2];
  StretchWatch watch(state.declare_numbers("verlet_stretches", StretchWatch::numbers));
  const bool estimated = options_.time_step <= 0;
  const auto make_plan = [&](double step) {
    first = static_cast<double>(state.step);
    start = state.time;
    counter = steps_to_end(start, step);
    dt = (options_.end_time - start) / counter;
  };
  // The share of the stable step that was asked for, and the one at which the step is planned anew: the largest eigenvalue that it tolerates.
  const double share = safety(problem), tolerated = std::max(share, std::min(1.2 * share, 0.97));
  const auto most = [&] {
    const double root = 2 * tolerated / dt;
    return root * root;
  };
  const bool watched = estimated && !problem.constant_stiffness();
  const bool fresh = dt == 0;
  if (fresh) {
    check_time_step(problem, options_.values, &observer);
    make_plan(first_step(problem));   // before the fields of the steps are there: it has its own
    softest = planned_.eigenvalue;
    if (watched) watch.estimated(problem.stretches(state.displacement()), 0, {planned_.eigenvalue, planned_.eigenvalue}, most());
    observer.log(fmt::format("verlet: {:.0f} steps of {:.6g} s", counter, dt));
    if (const std::string doubt = bond_based_doubt(problem); !doubt.empty()) observer.log(named("time_step", "warning: verlet: " + doubt));
    planned_ = {};
  }
  Stepper stepper(problem, !fresh);
  const FieldView v = state.velocity();
  Field speeds = problem.constraints().any() ? problem.make_field() : Field();
  Field old_external = stepper.loaded() && problem.loads().depend_on_time() ? problem.make_field() : Field();
  const auto report = [&] {
    StepReport r;
    r.step = state.step;
    r.time = state.time;
    r.time_step = dt;
    r.end_time = options_.end_time;
    r.steps_expected = static_cast<std::int64_t>(first + counter);
    return r;
  };
  double& planned_end = state.declare_numbers("planned_end", 1)[0];
  if (!fresh && planned_end != options_.end_time) {
    make_plan(dt);   // not the step: only its end is another
    observer.log(fmt::format("verlet: the run ends at {:.6g} s, not {:.6g} s: {:.0f} more steps of {:.6g} s", options_.end_time, planned_end, counter, dt));
  }
  planned_end = options_.end_time;
  if (fresh) {
    stepper.prescribed_speed(state.time, speeds);
    problem.constraints().prescribe_velocity(state.time, v);
    std::copy_n(v.data, v.size(), stepper.half().data);
    const bool sample = observer.wants_sample(0, state.time);
    stepper.evaluate(sample ? &state.energies.strain : nullptr, dt);
    last_dt = 0;
    observer.step_done(report());
  } else {
    stepper.prescribed_speed(state.time, speeds);
  }
  stepper.start_speed();
  const auto estimate = [&] {
    // That after a stretch tells how eigenvalues rise with stretches, too, where they do.
    const double enough = stretched > 0 ? watch.enough(most()) : most();
    EigenvalueBounds found = eigenvalue_bounds(problem, state.displacement(), enough, [&] { return !observer.interrupted(); });
    if (found.given_up) return;
    due = 0;
    found.bound = std::max(found.bound, failed);
    const double eigenvalue = found.bound;
    softest = std::min(softest, eigenvalue);
    if (eigenvalue > most()) {
      make_plan(beside_resonance(std::min(dt, step_of(problem, share, eigenvalue)), softest));
      observer.log(fmt::format("verlet: step {}: the stable step became smaller; {:.0f} more steps of {:.6g} s", state.step, counter, dt));
    }
    watch.estimated(problem.stretches(state.displacement()), state.step, found, most());
  };
  if (due > 0) estimate();
  while (state.step < static_cast<std::int64_t>(first + counter) && !observer.cancelled()) {
    const double t = state.time;
    // Half of the last step and half of the next: equal steps make it a whole one.
    const auto next = static_cast<double>(state.step + 1);
    const double t_next = next == first + counter ? options_.end_time : start + (next - first) * dt;
    stepper.advance(0.5 * (last_dt + dt), dt, t, t_next);
    state.time = t_next;
    ++state.step;
    const bool sample = observer.wants_sample(state.step, t_next);
    stepper.evaluate(sample ? &state.energies.strain : nullptr, dt);
    if (old_external.size() > 0) {
      std::copy_n(stepper.external().data, old_external.size(), old_external.data());
      stepper.load();
    }
    stepper.prescribed_speed(t_next, speeds);
    stepper.add_work_of_loads(dt, old_external);
    // Forces, velocity and energies are those of the bonds that are left.
    const bool fewer = problem.advance(dt, stepper.half());
    stepper.add_work_of_constraints(dt);
    last_dt = dt;
    if (sample) {
      stepper.kick(v, 0.5 * dt);
      problem.constraints().prescribe_velocity(t_next, v);
    }
    const bool last = state.step == static_cast<std::int64_t>(first + counter);
    // The largest eigenvalue rises at once where bonds fail, soon where the body is stretched or compressed fast, and slowly else.
    if (watched && !last) {
      failed = fewer ? eigenvalue_around_failed_bonds(problem, most()) : 0;
      stretched = watch.due(state.step) && watch.look(problem.stretches(state.displacement()), state.step);
      due = failed > 0 || stretched > 0 || state.step % options_.check_every == 0;
      if (due > 0) estimate();
    }
    observer.step_done(report());
  }
}

}  // namespace perikit
