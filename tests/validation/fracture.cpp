/// The fracture tests of Partmann et al., sections 5.2 and 5.3, on coarse lattices: where the crack goes, and where the energy goes.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tests/contract/integrator_fixture.hpp"
#include "tests/validation/scenes.hpp"

using namespace perikit;
using namespace perikit::validation;

namespace {

/// What is missing in the balance at the end, and what bonds dissipated [J].
struct Balance {
  double work, dissipated, missing;
};

Balance run(Simulation& simulation) {
  const contract::Watch watch = contract::run(simulation);
  const Energies& e = watch.energies.back();
  return {e.external_work, e.dissipated, e.external_work - e.strain - e.kinetic - e.dissipated};
}

/// Largest damage of the points where `inside` holds.
template <class Inside>
double most_damage(BodyProblem& problem, Inside&& inside) {
  const Field damage = problem.model().damage();
  double most = 0;
  for (const std::int32_t p : problem.body().internal())
    if (inside(problem.body().position(static_cast<std::size_t>(p)))) most = std::max(most, damage.data()[p]);
  return most;
}

}  // namespace

TEST_CASE("mode I: a straight crack to the right edge, and nothing else") {
  for (const char* kinematics : {"bond_based", "ordinary"}) {
    INFO(kinematics);
    // Ten times faster than in the paper, so that the run is short.
    const auto simulation = load("partmann/mode_I.toml", {fmt::format("kinematics={}", kinematics), "body.lattice.spacing=4e-5", "constants.dx=4e-5", "integrator.end_time=1.6e-5",
                                                          "boundary=[{set=\"top\", velocity=[\"free\", 0.5, \"free\"]}, {set=\"bottom\", velocity=[\"free\", -0.5, \"free\"]}]"});
    BodyProblem& problem = simulation->problem();
    const double before = most_damage(problem, [](const Point& x) { return x[0] > 0.2e-3; });
    const Balance balance = run(*simulation);
    CHECK(before == 0);
    CHECK(most_damage(problem, [](const Point& x) { return x[0] > 0.46e-3; }) > 0.35);
    CHECK(most_damage(problem, [](const Point& x) { return std::abs(x[1]) > 0.25e-3; }) < 0.1);
    CHECK(balance.dissipated > 0);
    CHECK_MESSAGE(std::abs(balance.missing) <= 0.03 * balance.dissipated, balance.missing, " J missing, ", balance.dissipated, " J dissipated");
  }
}

TEST_CASE("boundary tension: the energy balance holds to the end, whatever the number of threads and the checks that are skipped") {
  const auto scene = [](std::vector<std::string> more) {
    more.insert(more.end(), {"body.lattice.spacing=1e-3", "constants.dx=1e-3", "integrator.end_time=4e-5"});
    return load("partmann/boundary_tension.toml", std::move(more));
  };
  const auto simulation = scene({});
  const Balance balance = run(*simulation);
  CHECK(balance.dissipated > 0);
  CHECK_MESSAGE(std::abs(balance.missing) <= 0.01 * balance.work, balance.missing, " J missing, work ", balance.work, " J");
  CHECK(most_damage(simulation->problem(), [](const Point& x) { return x[0] > 0.08; }) > 0.35);
  // The same bonds fail at the same steps when every bond is looked at in every step.
  const auto all = scene({"run.skip=false"});
  run(*all);
  const BondChecks some = simulation->problem().model().bond_checks(), every = all->problem().model().bond_checks();
  CHECK(every.checked == every.groups);
  CHECK(some.checked < some.groups);
  CHECK(some.failed == every.failed);
}
