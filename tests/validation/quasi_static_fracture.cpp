/// Cracks in quasi-static runs: the plate with a hole of Hashim et al., section 4.5, on coarse lattices, steps that are given up,
/// and limits.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "perikit/core/field_operations.hpp"
#include "perikit/sdk/load_steps.hpp"
#include "perikit/sdk/tangent_predictor.hpp"
#include "tests/contract/integrator_fixture.hpp"
#include "tests/contract/witness_problem.hpp"
#include "tests/validation/quasi_static.hpp"

using namespace perikit;
using namespace perikit::validation;

namespace {

std::unique_ptr<Simulation> plate_with_hole(std::vector<std::string> more, double dx = 5e-3) {
  more.push_back(fmt::format("constants.dx={}", dx));
  return load("hashim/plate_with_hole.toml", std::move(more));
}

/// Newton's method with conjugate gradients, that says of one of its solves that it failed.
class Refusing final : public EquilibriumSolver {
 public:
  std::function<bool()> refuse;
  std::function<void()> at_begin;
  Solution solve(Equilibrium& equilibrium, bool extrapolated) override {
    at_begin();
    Solution solution;
    if (refuse()) {
      solution.failure = "it was told to";
      return solution;
    }
    Field r = equilibrium.problem().make_field();
    for (; solution.iterations < 100; ++solution.iterations) {
      if (!predict_by_tangent(equilibrium, extrapolated) || !equilibrium.residual(equilibrium.displacement(), r)) return solution;
      extrapolated = false;
      solution.converged = equilibrium.converged();
      if (solution.converged) break;
    }
    return solution;
  }
};

}  // namespace

TEST_CASE("plate with a hole: cracks start at the hole's edge and run to the sides") {
  for (const char* damage : {"{type=\"smooth_degradation\",stretch_min=0.0015,stretch=0.002,no_fail=[\"left\",\"right\"]}",
                             "{type=\"critical_stretch\",stretch=0.002,no_fail=[\"left\",\"right\"]}"}) {
    INFO(std::string(damage));
    const auto simulation = plate_with_hole({fmt::format("damage={}", damage)}, 2.5e-3);
    BodyProblem& problem = simulation->problem();
    const Body& body = problem.body();
    contract::Watch watch(*simulation);
    contract::WitnessProblem witness(problem);
    double first_at = 0, first_x = 0, first_radius = 0, peak = 0;
    witness.after = [&] {
      if (first_radius > 0 || problem.families().changed().empty()) return;
      const Field lost = problem.terms().damage();
      const std::int32_t worst =
          *std::max_element(body.internal().begin(), body.internal().end(),
                            [&](std::int32_t a, std::int32_t b) { return lost.data()[a] < lost.data()[b]; });
      const Point x = body.position(static_cast<std::size_t>(worst));
      first_x = std::abs(x[0]);
      first_radius = std::hypot(x[0], x[1]);
    };
    watch.each = [&](const StepReport& report) {
      peak = std::max(peak, validation::pull(*simulation, "right", 0));
      if (first_at == 0 && first_radius > 0) first_at = report.time;
    };
    simulation->integrator().run(witness, watch);
    // The edge is stretched 2.9 times as much as the plate, 0.2 mm in 150 mm at the end: the critical stretch is reached halfway.
    CHECK((first_at > 0.3 && first_at < 0.7));
    CHECK(first_x < 0.006);
    CHECK(first_radius < 0.014);
    CHECK(peak > 0);
    // At the end the plate is in two: damage on both sides of the hole from edge to edge, and nowhere else.
    const Field lost = problem.terms().damage();
    for (const double side : {-1.0, 1.0})
      for (double y = 0.011; y < 0.025; y += 2.5e-3) {
        double most = 0;
        for (const std::int32_t p : body.internal()) {
          const Point x = body.position(static_cast<std::size_t>(p));
          if (std::abs(x[0]) < 0.012 && std::abs(x[1] - side * y) < 2.5e-3) most = std::max(most, lost.data()[p]);
        }
        CHECK_MESSAGE(most > 0.3, "at y = ", side * y, " damage is ", most);
      }
    for (const std::int32_t p : body.internal())
      if (std::abs(body.position(static_cast<std::size_t>(p))[0]) > 0.025) CHECK(lost.data()[p] < 0.05);
    CHECK(std::abs(validation::pull(*simulation, "right", 0)) <= 1e-6 * peak);
    const Energies& e = problem.state().energies;
    CHECK_MESSAGE(std::abs(e.external_work - e.strain - e.dissipated) <= 1e-3 * e.external_work, "work ", e.external_work,
                  ", dissipated ", e.dissipated);
  }
}

TEST_CASE("plate with a hole: the paper's second solver, dynamic relaxation, finds the same crack") {
  const auto newton = plate_with_hole({}),
             relaxed = plate_with_hole({"integrator={type=\"dynamic_relaxation\",steps=15,tolerance=1e-8}"});
  run(*newton);
  run(*relaxed);
  const Field a = newton->problem().terms().damage(), b = relaxed->problem().terms().damage();
  double worst = 0;
  for (const std::int32_t p : newton->problem().body().internal()) worst = std::max(worst, std::abs(a.data()[p] - b.data()[p]));
  CHECK_MESSAGE(worst <= 1e-3, "damage differs by ", worst);
  CHECK(relaxed->problem().state().energies.dissipated == doctest::Approx(newton->problem().state().energies.dissipated).epsilon(1e-3));
}

TEST_CASE("the companion preconditioner loses its springs with the bonds: fewer iterations where the plate has cracked") {
  const auto simulation =
      plate_with_hole({"kinematics=baqp", "damage={type=\"critical_stretch\",stretch=0.002,no_fail=[\"left\",\"right\"]}",
                       "integrator={type=\"jfnk\",steps=15,tolerance=1e-8,preconditioner=\"companion\"}"},
                      2.5e-3);
  const Protocol protocol = run(*simulation);
  CHECK(simulation->problem().fracture()->checks().failed > 100);
  int all = 0, most = 0;
  for (std::size_t at = protocol.text.find("gmres "); at != std::string::npos; at = protocol.text.find("gmres ", at + 1)) {
    const int iterations = std::atoi(&protocol.text[at + 6]);
    all += iterations;
    most = std::max(most, iterations);
  }
  MESSAGE(all, " GMRES iterations, at most ", most, " a solve");
  // With springs across the cracks 1340, and up to 73.
  CHECK(all <= 1000);
  CHECK(most <= 40);
}

TEST_CASE("a step that is given up between two equilibria gives its bonds back") {
  const auto simulation = plate_with_hole({"integrator.steps=4"});
  BodyProblem& problem = simulation->problem();
  Refusing solver;
  std::size_t refusals = 0;
  std::vector<std::byte> bonds = problem.bonds();
  std::vector<double> u = contract::displacement(*simulation);
  Energies energies;
  bool check = false;
  solver.refuse = [&] {
    // The first time that equilibrium is to be found again.
    const bool again = problem.bonds() != bonds && refusals == 0;
    refusals += again;
    check = check || again;
    return again;
  };
  solver.at_begin = [&] {
    if (!check || refusals != 1) return;
    CHECK(problem.bonds() == bonds);
    CHECK(contract::displacement(*simulation) == u);
    CHECK(problem.state().energies.dissipated == energies.dissipated);
    CHECK(problem.state().energies.external_work == energies.external_work);
    check = false;
  };
  contract::Watch watch(*simulation, 4);
  watch.each = [&](const StepReport&) {
    bonds = problem.bonds();
    u = contract::displacement(*simulation);
    energies = problem.state().energies;
  };
  run_load_steps("refusing", {.steps = 4, .tolerance = 1e-8, .max_iterations = 100, .cut_backs = 5}, problem, watch, solver);
  CHECK(refusals == 1);
  CHECK(!check);
  // The step that was given up came again at half its length.
  const bool halved = std::any_of(watch.reports.begin(), watch.reports.end(),
                                  [](const StepReport& report) { return report.step > 0 && report.time_step == 0.125; });
  CHECK(halved);
}

TEST_CASE("bond_rounds ends a run that breaks on, with load parameter and key") {
  const auto simulation = plate_with_hole({"integrator.bond_rounds=2"});
  Protocol protocol;
  CHECK_THROWS_WITH_AS(simulation->run(protocol), doctest::Contains("newton: bonds go on failing at load parameter 0."),
                       RunError);
  CHECK(protocol.reports.back().time > 0);
  CHECK(protocol.reports.back().time < 1);
  CHECK(protocol.text.find("bonds fail, round   2: ") != std::string::npos);
  // Each iteration on the way to the next equilibrium tells of its round and of the bonds that have failed until then.
  CHECK(std::ranges::any_of(protocol.shown, [](const std::string& line) { return line.find(": round 2 of failing bonds, ") != line.npos && line.find(" failed: iteration ") != line.npos; }));
}

TEST_CASE("a body that falls apart under a load has no equilibrium, and the run says so") {
  const auto simulation =
      plate_with_hole({"integrator.steps=4", "integrator.cut_backs=2", "boundary=[{set=\"left\",displacement=[0,0]}]",
                       "load=[{set=\"right\",force=[1.2e7,0]}]"});
  Protocol protocol;
  CHECK_THROWS_WITH_AS(simulation->run(protocol), doctest::Contains("newton: no equilibrium found beyond load parameter"),
                       RunError);
}
