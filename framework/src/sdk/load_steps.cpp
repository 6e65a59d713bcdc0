#include "perikit/sdk/load_steps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "perikit/core/communicator.hpp"
#include "perikit/core/field_operations.hpp"
#include "perikit/core/warnings.hpp"
#include "sdk/alternating_volumes.hpp"

namespace perikit {

ParameterTable load_step_parameters(std::int64_t max_iterations) {
  ParameterTable table;
  table.integer("steps", "Planned steps of the load parameter from 0 to 1; cut back where a step fails.").by_default("10").at_least(1).at_most(1e6);
  table.number("tolerance", "-", "Out-of-balance force over the norm of reactions and loads.").by_default("1.0e-8").positive().below(1.0);
  table.integer("max_iterations", "Iterations of a step before it is cut back.").by_default(fmt::to_string(max_iterations)).at_least(1).at_most(1e9);
  table.integer("cut_backs", "Halvings of a planned step before the run gives up.").by_default("10").at_least(0).at_most(30);
  table
      .integer(
          "bond_rounds",
          "With [damage]: times that bonds may fail, each followed by a new equilibrium, at one load; beyond, the run gives up.")
      .by_default("1000")
      .at_least(1)
      .at_most(1e9);
  return table;
}

LoadStepOptions load_step_options(const ParameterValues& values) {
  return {values.integer("steps"), values.number("tolerance"), values.integer("max_iterations"), values.integer("cut_backs"),
          values.integer("bond_rounds")};
}

namespace {

/// Bonds that weaken gradually do so less and less at one load, and never cease to. What puts the body out of balance by less
/// than this share of the largest reference of the run is left to the next step.
constexpr double negligible = 1e-6;

class LoadSteps {
 public:
  LoadSteps(std::string_view integrator, const LoadStepOptions& options, Problem& problem, Observer& observer,
            EquilibriumSolver& solver)
      : integrator_(integrator),
        options_(options),
        problem_(problem),
        state_(problem.state()),
        observer_(observer),
        solver_(solver),
        equilibrium_(problem, options.tolerance),
        u_(state_.displacement()),
        last_increment_(state_.declare("load_step_increment")),
        residual_(problem.make_field()),
        driving_(problem.make_field()),
        old_driving_(problem.make_field()),
        start_(problem.make_field()),
        numbers_(state_.declare_numbers("load_steps", 6)) {}

  void run() {
    double& planned_end = state_.declare_numbers("planned_end", 1)[0];
    if (started() == 0) {
      planned_end = planned();
      begin();
    } else if (planned_end != planned()) {
      plan_anew(planned() / planned_end);
      planned_end = planned();
    }
    find_driving_force(old_driving_);
    equilibrium_.watch(observer_);
    while (position() < planned() && !observer_.cancelled()) {
      if (step()) continue;
      observer_.stopped_within_step();
      return;
    }
    if (observer_.cancelled()) return;
    if (const std::string warning = warn_of_alternating_volumes(problem_, u_); !warning.empty()) observer_.log(named("volumes", "warning: " + warning));
  }

 private:
  // The position counts planned steps and is a binary fraction between them: sums of it are exact.
  double& started() noexcept { return numbers_[0]; }
  double& position() noexcept { return numbers_[1]; }
  double& increment() noexcept { return numbers_[2]; }        ///< of the position, for the next step
  double& last_span() noexcept { return numbers_[3]; }        ///< length of the last step; 0: none to continue
  double& largest_reference() noexcept { return numbers_[4]; }  ///< of the equilibria so far [N]
  double& told_unstable() noexcept { return numbers_[5]; }      ///< 1: the warning is in the log
  double planned() const noexcept { return static_cast<double>(options_.steps); }

  void begin() {
    observer_.log(fmt::format("{}: {} load steps, relative tolerance {:.3g}", integrator_, options_.steps, options_.tolerance));
    equilibrium_.begin(0.0, u_);
    const bool sample = observer_.wants_sample(state_.step, state_.time);
    if (!equilibrium_.residual(u_, residual_, sample ? &state_.energies.strain : nullptr)) {
      throw RunError(fmt::format("{}: the initial displacement is inadmissible: {}", integrator_, equilibrium_.failure()));
    }
    warn_of_jumps();
    started() = 1;
    increment() = 1;
    report(0.0, 0);
  }

  /// A first step that has to find what should have been there at its start may take long, or end elsewhere.
  void warn_of_jumps() {
    if (const double gap = equilibrium_.missing(u_, driving_); gap > 1e-12 * problem_.points().spacing())
      observer_.log(
          named("first_step", fmt::format("warning: prescribed displacements are up to {:.3g} m away from the initial ones at load parameter 0; the "
                      "first step makes up for it",
                      gap)));
    if (!equilibrium_.converged())
      observer_.log(
          named("first_step", fmt::format("warning: the body is out of balance by {:.3g} N at load parameter 0, by its initial displacement or by "
                      "loads that do not begin at 0; "
                      "the first step starts from there",
                      equilibrium_.residual_norm())));
  }

  std::string hint_of_volumes() {
    const std::string warning = warn_of_alternating_volumes(problem_, equilibrium_.displacement());
    return warning.empty() ? warning : "; where it failed " + warning;
  }

  /// The same load, of another number of planned steps: `ratio` times as many.
  void plan_anew(double ratio) {
    position() *= ratio;
    last_span() *= ratio;
    increment() = std::min(1.0, std::exp2(std::floor(std::log2(increment() * ratio))));
    observer_.log(fmt::format("{}: goes on at load parameter {:.9g} with {} load steps", integrator_, state_.time, options_.steps));
  }

  /// False where the run is to end within the step.
  bool step() {
    // A step never passes a planned point.
    double span = std::min(increment(), std::floor(position()) + 1 - position());
    const double smallest = std::ldexp(1.0, -static_cast<int>(options_.cut_backs));
    remember();
    for (;;) {
      Solution solution = attempt(span, last_span() > 0);
      // A continuation that cannot even be evaluated is dropped before the step is.
      if (!solution.converged && solution.iterations == 0 && last_span() > 0 && equilibrium_.step_factor() == 1) solution = attempt(span, false);
      if (solution.converged) settle(span, solution);
      if (solution.converged) {
        accept(span, solution);
        return true;
      }
      give_up();
      if (equilibrium_.stopped()) return false;
      const double asked = equilibrium_.step_factor();
      if (asked < 1) solution.failure = equilibrium_.failure();
      const double t = (position() + span) / planned();
      equilibrium_.note(fmt::format("  no equilibrium at t = {:.9g}: {}", t, solution.failure));
      observer_.log(equilibrium_.take_notes());   // a step that fails may take long to do so
      if (asked < 1 ? span <= smallest : span / 2 < smallest) {
        throw RunError(fmt::format(
            "{}: no equilibrium found beyond load parameter {:.9g} (after step {}): the smallest step, {:.3g}, failed because {}. More steps or cut_backs may "
            "help; past a limit point (snap-through, buckling, failure of the material) the load cannot grow, and the path is not followed{}",
            integrator_, state_.time, state_.step, span / planned(), solution.failure, hint_of_volumes()));
      }
      // In whole smallest steps, so that sums of spans stay exact.
      span = asked < 1 ? std::max(std::floor(span * asked / smallest), 1.0) * smallest : span / 2;
      increment() = span;
    }
  }

  Solution attempt(double span, bool extrapolate) {
    const double t = (position() + span) / planned();
    copy(u_, start_);
    if (extrapolate) combine(1, u_, span / last_span(), last_increment_, start_);
    equilibrium_.stage("");
    equilibrium_.note(fmt::format("step {}  t = {:.9g}", state_.step + 1, t));
    return find(span, extrapolate);
  }

  /// The equilibrium so far from the position, from start_.
  Solution find(double span, bool extrapolated) {
    equilibrium_.begin((position() + span) / planned(), start_, span / planned());
    Solution solution = solver_.solve(equilibrium_, extrapolated);
    if (!solution.converged) return solution;
    // Forces and energy of exactly this state, and the judgement of this class rather than the solver's.
    equilibrium_.impose(equilibrium_.displacement());
    solution.converged = equilibrium_.residual(equilibrium_.displacement(), residual_, &state_.energies.strain);
    if (!solution.converged) solution.failure = equilibrium_.failure();
    if (solution.converged && !equilibrium_.converged()) {
      solution.converged = false;
      solution.failure = fmt::format("the residual stays at {:.3g} (tolerance {:.3g})", equilibrium_.relative_residual(), options_.tolerance);
    }
    return solution;
  }

  /// The equilibrium that was found is the state of the body; its work counts.
  void take() {
    largest_reference() = std::max(largest_reference(), equilibrium_.reference());
    find_driving_force(driving_);
    combine(1, equilibrium_.displacement(), -1, u_, last_increment_);
    state_.energies.external_work += 0.5 * (dot(old_driving_, last_increment_) + dot(driving_, last_increment_));
    copy(driving_, old_driving_);
    copy(equilibrium_.displacement(), u_);
  }

  /// Lets bonds fail at the equilibrium that was found, and finds equilibrium again at the same load, until no more fail or what
  /// they did is negligible.
  void settle(double span, Solution& solution) {
    const double t = (position() + span) / planned();
    Energies& energies = state_.energies;
    state_.time = t;
    take();
    continues_ = true;
    bool settled = false;
    for (std::int64_t round = 1; !settled && problem_.update_bonds(equilibrium_.at(u_), round == 1 ? span / planned() : 0); ++round) {
      continues_ = false;
      solver_.bonds_changed();
      solution.converged = equilibrium_.residual(u_, residual_, &energies.strain);
      if (!solution.converged) solution.failure = equilibrium_.failure();
      if (!solution.converged || equilibrium_.converged()) break;
      settled = equilibrium_.residual_norm() <= negligible * largest_reference();
      const std::int64_t failed = problem_.failed_bonds();
      equilibrium_.note(fmt::format("  bonds fail, round {:3}: {} failed, {:.4g} J dissipated so far", round, failed, energies.dissipated));
      equilibrium_.stage(fmt::format("round {} of failing bonds, {} failed: ", round, failed));
      if (round > options_.bond_rounds) {
        observer_.log(equilibrium_.take_notes());
        throw RunError(
            fmt::format("{}: bonds go on failing at load parameter {:.9g} (after step {}): {} times, each followed by a new "
                        "equilibrium, as many as bond_rounds allows. "
                        "The body may be about to break apart; a crack that has far to run at one load needs more rounds",
                        integrator_, t, state_.step, options_.bond_rounds));
      }
      if (!settled && solver_.forecast_bonds(equilibrium_, u_, residual_)) {
        solver_.bonds_changed();
        solution.converged = equilibrium_.residual(u_, residual_, &energies.strain);
        if (!solution.converged) break;
      }
      const double held = energies.strain - energies.external_work;
      copy(u_, start_);
      const Solution again = find(span, false);
      solution.iterations += again.iterations;
      solution.converged = again.converged;
      solution.failure = again.failure;
      if (!again.converged) break;
      take();
      energies.dissipated += held - (energies.strain - energies.external_work);
    }
    if (!continues_) find_driving_force(old_driving_);
  }

  void accept(double span, const Solution& solution) {
    position() += span;
    last_span() = continues_ ? span : 0;  // the path has a kink where bonds have failed
    increment() = std::min(1.0, 2 * span);
    state_.time = position() / planned();
    ++state_.step;
    solver_.accepted(problem_, u_);
    problem_.accept();
    watch_stability();
    observer_.log(equilibrium_.take_notes());
    observer_.wants_sample(state_.step, state_.time);
    report(span / planned(), solution.iterations);
  }

  /// Tells the first equilibrium that is not stable. What cannot be told, because the run is to end, is not.
  void watch_stability() {
    if (told_unstable() != 0 || !solver_.unstable(equilibrium_, u_, position() >= planned())) return;
    told_unstable() = 1;
    equilibrium_.note(named("unstable", fmt::format(
        "warning: {}: the equilibrium at load parameter {:.6g} is not stable: there is a motion by which the body would leave it on its own, as past buckling or a "
        "limit point. Results from here on may be those of an unstable branch; more steps, a small force or imperfection that chooses a side, or "
        "dynamic_relaxation, which moves on to stable equilibria, find another one",
        integrator_, state_.time)));
  }

  /// With [damage] a step consists of several equilibria: what is needed to return to where it began.
  void remember() {
    bonds_ = problem_.bonds();
    if (bonds_.empty()) return;
    first_ = state_.energies;
    for (Field* field : {&first_u_, &first_driving_, &first_increment_})
      if (field->size() == 0) *field = problem_.make_field();
    copy(u_, first_u_);
    copy(old_driving_, first_driving_);
    copy(last_increment_, first_increment_);
  }

  void give_up() {
    problem_.revert();
    state_.time = position() / planned();
    if (bonds_.empty()) return;
    state_.energies = first_;
    copy(first_u_, u_);
    copy(first_driving_, old_driving_);
    copy(first_increment_, last_increment_);
    if (communicator().largest(problem_.bonds() == bonds_ ? 0 : 1) == 0) return;  // on no rank
    problem_.restore_bonds(bonds_);
    solver_.bonds_changed();
  }

  /// What moves the body from outside: the loads, and on prescribed components load and reaction, -internal force [N].
  void find_driving_force(FieldView force) {
    if (problem_.loads().any()) copy(state_.external_force(), force);
    else fill(0.0, force);
    const FieldView internal = state_.internal_force();
    for (const std::int64_t dof : problem_.constraints().dofs()) force.data[dof] = -internal.data[dof];
  }

  void report(double time_step, int iterations) {
    StepReport r;
    r.step = state_.step;
    r.time = state_.time;
    r.time_step = time_step;
    r.iterations = iterations;
    r.residual = equilibrium_.relative_residual();
    r.end_time = 1.0;
    r.steps_expected = state_.step + static_cast<std::int64_t>(std::ceil(planned() - position()));
    observer_.step_done(r);
  }

  std::string integrator_;
  LoadStepOptions options_;
  Problem& problem_;
  State& state_;
  Observer& observer_;
  EquilibriumSolver& solver_;
  Equilibrium equilibrium_;
  FieldView u_, last_increment_;
  Field residual_, driving_, old_driving_, start_;
  std::span<double> numbers_;
  bool continues_ = true;         ///< no bond has failed in the last step
  std::vector<std::byte> bonds_;  ///< at the beginning of the step; empty without [damage]
  Field first_u_, first_driving_, first_increment_;
  Energies first_;
};

}  // namespace

void run_load_steps(std::string_view integrator, const LoadStepOptions& options, Problem& problem, Observer& observer, EquilibriumSolver& solver) {
  LoadSteps(integrator, options, problem, observer, solver).run();
}

}  // namespace perikit
