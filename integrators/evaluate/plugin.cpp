#include "perikit/integrator.hpp"

namespace {

using namespace perikit;

/// Energy, forces and fields of the initial displacement: no time, no equilibrium.
class Evaluate final : public Integrator {
 public:
  explicit Evaluate(const ParameterValues& values) : values_(values) {}
  IntegratorTraits traits() const noexcept override { return {.several_ranks = true}; }
  std::string plan(Problem& problem) override {
    refuse_damage(problem);
    return "one evaluation of the initial displacement";
  }
  void run(Problem& problem, Observer& observer) override {
    refuse_damage(problem);
    State& state = problem.state();
    if (problem.loads().any()) problem.external_forces(problem.configuration(), state.external_force());
    const EvaluationStatus status = problem.evaluate_forces(problem.configuration(), state.internal_force(), &state.energies.strain);
    if (!status.ok()) throw RunError(status.description);
    observer.wants_sample(0, 0.0);
    observer.step_done({});
  }

 private:
  void refuse_damage(Problem& problem) const {
    if (problem.bonds().empty()) return;
    throw values_.error(
        "type",
        "found \"evaluate\" in a scene with [damage], whose bonds fail at the end of steps; allowed: another integrator, or no "
        "[damage]: bonds that are broken from the start are those of [[crack]]");
  }

  ParameterValues values_;
};

}  // namespace

PERIKIT_PLUGIN(registrar) {
  registrar.integrator(
      {.name = "evaluate",
       .summary = "energy, forces and fields of the initial displacement",
       .parameters = {},
       .examples = {""},
       .equations = "Pi(u0), f(u0) = -dPi/du",
       .source = "used for the zero-energy modes of Partmann et al. (section 4.4) and Chowdhury et al. (section 3)",
       .limits = "Boundaries are not applied: the displacement is that of [initial]. Bonds of [[crack]] are cut; [damage] is "
                 "refused, as no step ends."},
      [](const ParameterValues& values, const PartFactory&) { return std::make_unique<Evaluate>(values); });
}
