/// What every quasi-static integrator must fulfil, with the keys steps and tolerance: load parameters that end at 1, equilibrium at
/// every step, answers that are linear where the problem is and do not depend on the number of steps where it is not.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "perikit/core/parallel.hpp"
#include "perikit/problem/motion.hpp"
#include "tests/contract/integrator_fixture.hpp"

using namespace perikit;
using namespace perikit::contract;

namespace {

constexpr double tolerance = 1e-10;

std::vector<Example> quasi_static_integrators(int steps) {
  return integrators([](const IntegratorTraits& traits) { return traits.quasi_static; },
                     {{"steps", std::to_string(steps)}, {"tolerance", fmt::format("{}", tolerance)}});
}

/// A plate, held at `left` and pulled at `right`; without a density, which statics do not need.
BodyOptions plate(bool cloud) {
  BodyOptions body;
  body.dimension = 2;
  body.cloud = cloud;
  body.cells = 10;
  body.sets = "left = \"x < 2\"\nright = \"x > 6\"\n";
  body.conditions = "[[boundary]]\nset = \"left\"\ndisplacement = [0, 0]\n";
  return body;
}

std::unique_ptr<Simulation> build_run(BodyOptions body, const Example& integrator) {
  body.integrator = integrator_table(integrator);
  return build(scene_text(body, "type = \"baqp\""));
}

/// Largest |internal + external| over free components, in units of the largest reaction.
double residual(BodyProblem& problem) {
  const ConstFieldView free = problem.constraints().free();
  const FieldView external = problem.loads().any() ? problem.state().external_force() : FieldView{};
  double most = 0;
  for (std::size_t k = 0; k < free.size(); ++k) {
    if (free.data[k] == 1.0) most = std::max(most, std::abs(problem.state().internal_force().data[k] + (external.data ? external.data[k] : 0.0)));
  }
  return most / largest(problem.body(), reactions(problem, false, problem.state().time));
}

}  // namespace

TEST_CASE("integrator: quasi-static steps are in equilibrium, meet what is prescribed and end at load parameter 1") {
  for (const bool cloud : {false, true}) {
    BodyOptions body = plate(cloud);
    body.two_materials = true;
    // A plain number ramps; an expression is used as it is.
    body.conditions += "[[boundary]]\nset = \"right\"\ndisplacement = [0.3, \"0.1*sin(pi*t/2)*x\"]\n[[load]]\nset = \"part\"\nforce = [0, 0.02]\n";
    for (const Example& integrator : quasi_static_integrators(5)) {
      INFO(integrator.part, std::string(cloud ? " cloud" : " lattice"));
      const auto simulation = build_run(body, integrator);
      BodyProblem& problem = simulation->problem();
      const Body& b = problem.body();
      Watch watch(*simulation);
      double missed = 0, unbalanced = 0, load = 0;
      watch.each = [&](const StepReport& report) {
        if (report.step == 0) return;
        const double t = report.time;
        CHECK(problem.state().time == t);
        for (const std::int32_t p : b.set("right")) {
          const double x = b.position(static_cast<std::size_t>(p))[0];
          missed = std::max({missed, std::abs(problem.state().displacement().component(0)[p] - 0.3 * t),
                             std::abs(problem.state().displacement().component(1)[p] - 0.1 * std::sin(std::numbers::pi * t / 2) * x)});
        }
        unbalanced = std::max(unbalanced, residual(problem));
        load = std::max(load, std::abs(total(b, problem.state().external_force(), 1) - 0.02 * t));
      };
      simulation->run(watch);
      CHECK(watch.reports.back().time == 1.0);
      CHECK(watch.reports.back().end_time == 1.0);
      CHECK_MESSAGE(watch.reports.size() >= 6, "fewer steps than asked for");
      CHECK_MESSAGE(missed <= 1e-15, "a prescribed displacement is missed by ", missed);
      CHECK_MESSAGE(unbalanced <= 100 * tolerance, "a free component keeps a residual of ", unbalanced, " of the largest reaction");
      CHECK_MESSAGE(load <= 1e-15, "the load at a step is off by ", load);
      const Field reaction = reactions(problem, false, 1.0);
      for (const int c : {0, 1}) {
        const double sum = total(b, reaction, c) + total(b, problem.state().external_force(), c);
        CHECK_MESSAGE(std::abs(sum) <= 100 * tolerance * static_cast<double>(b.points()) * largest(b, reaction), "reactions and loads leave ", sum);
      }
      double energy = 0;
      Field force = problem.body().make_field(2);
      REQUIRE(problem.evaluate_forces({problem.state().displacement(), 0}, force, &energy).ok());
      CHECK(std::abs(problem.state().energies.strain - energy) <= 1e-12 * energy);
    }
  }
}

TEST_CASE("integrator: a linear quasi-static problem has linear answers, and its work is stored") {
  for (const bool cloud : {false, true}) {
    BodyOptions body = plate(cloud);
    body.material = "type = \"linear_elastic\"\nyoungs_modulus = 2.0\npoisson_ratio = 0.3";
    body.conditions += "[[boundary]]\nset = \"right\"\ndisplacement = [0.2, \"free\"]\n[[load]]\nset = \"part\"\nforce = [0.1, 0.05]\n";
    for (const Example& integrator : quasi_static_integrators(4)) {
      INFO(integrator.part, std::string(cloud ? " cloud" : " lattice"));
      const auto simulation = build_run(body, integrator);
      Watch watch(*simulation);
      std::vector<double> half;
      double energy_at_half = 0;
      watch.each = [&](const StepReport& report) {
        if (report.time != 0.5) return;
        half = displacement(*simulation);
        energy_at_half = simulation->problem().state().energies.strain;
      };
      simulation->run(watch);
      std::vector<double> whole = displacement(*simulation), twice = half;
      REQUIRE_MESSAGE(half.size() == whole.size(), "no step at half the load");
      for (double& u : twice) u *= 2;
      const Energies& energies = simulation->problem().state().energies;
      CHECK_MESSAGE(difference(twice, whole) <= 1e-7 * largest(whole), "twice half the load moves ", difference(twice, whole), " further");
      CHECK(std::abs(4 * energy_at_half - energies.strain) <= 1e-7 * energies.strain);
      CHECK_MESSAGE(std::abs(energies.external_work - energies.strain) <= 1e-7 * energies.strain, "work ", energies.external_work, ", stored ", energies.strain);
    }
  }
}

TEST_CASE("integrator: the quasi-static answer depends neither on the steps nor on threads nor on a stop") {
  for (const bool cloud : {false, true}) {
    BodyOptions body = plate(cloud);
    body.two_materials = true;
    body.conditions += "[[boundary]]\nset = \"right\"\ndisplacement = [0.3, 0.1]\n";
    const auto many = quasi_static_integrators(8), few = quasi_static_integrators(4);
    for (std::size_t k = 0; k < few.size(); ++k) {
      INFO(few[k].part, std::string(cloud ? " cloud" : " lattice"));
      const auto in_many = build_run(body, many[k]), in_few = build_run(body, few[k]);
      const std::int64_t steps = run(*in_few).reports.back().step;
      run(*in_many);
      const std::vector<double> u = displacement(*in_few);
      CHECK_MESSAGE(difference(displacement(*in_many), u) <= 1e-6 * largest(u), "twice the steps change it by ", difference(displacement(*in_many), u));
      const int threads = thread_count();
      set_thread_count(threads == 1 ? 2 : 1);
      const auto other = build_run(body, few[k]);
      run(*other);
      set_thread_count(threads);
      CHECK_MESSAGE(difference(displacement(*other), u) <= 1e-10 * largest(u), "threads change it by ", difference(displacement(*other), u));
      const auto first = build_run(body, few[k]), second = build_run(body, few[k]);
      run(*first, steps / 2);
      second->problem().restore(first->problem().snapshot());
      const Watch rest = run(*second);
      CHECK(rest.reports.front().step == steps / 2 + 1);
      CHECK(second->problem().state().time == 1.0);
      CHECK_MESSAGE(difference(displacement(*second), u) <= 1e-10 * largest(u), "a stop changes it by ", difference(displacement(*second), u));
    }
  }
}

TEST_CASE("integrator: quasi-static paths of a law that remembers, in closed form") {
  // A uniform strain in ten steps: s grows by the strain of each, 2 (U1 - U0)/(U0 + U1), and the work by (J0 s0 + J1 s1)/2 of it.
  constexpr int steps = 10, cells = 30;
  constexpr double stretch = 0.3;
  for (const Example& integrator : quasi_static_integrators(steps)) {
    INFO(integrator.part, ": ", integrator.table);
    BodyOptions body{.dimension = 1, .material = "type = \"hypoelastic\"\nyoungs_modulus = 2.0\npoisson_ratio = 0.3"};
    body.cells = cells;
    body.sets = "ends = \"x < 8 || x > 22\"\n";
    body.conditions = fmt::format("[[boundary]]\nset = \"ends\"\ndisplacement = [\"{}*t*x\"]\n", stretch);
    const auto simulation = build_run(body, integrator);
    Watch watch(*simulation);
    simulation->run(watch);
    BodyProblem& problem = simulation->problem();
    REQUIRE(problem.laws().space() == Space::line_strain);
    const Moduli moduli = problem.laws().moduli(static_cast<std::size_t>(problem.body().owned().front()));
    double s = 0, psi = 0, volume = 0;
    for (int n = 1; n <= steps; ++n) {
      const double before = 1 + stretch * (n - 1) / steps, after = 1 + stretch * n / steps, strain = 2 * (after - before) / (before + after);
      const double s_before = s;
      s += (moduli.lambda + 2 * moduli.mu) * strain;
      psi += 0.5 * (before * s_before + after * s) * strain;
    }
    for (const std::int32_t p : problem.body().internal()) volume += problem.body().volume(static_cast<std::size_t>(p));
    CHECK(problem.state().energies.strain == doctest::Approx(psi * volume).epsilon(1e-8));
    for (const std::int32_t p : problem.body().internal())
      CHECK(std::abs(problem.state().displacement().component(0)[p] - stretch * problem.body().position(static_cast<std::size_t>(p))[0]) < 1e-7);
  }
}

TEST_CASE("integrator: quasi-static paths of a law that remembers go on to the bit after a stop") {
  BodyOptions body = plate(false);
  body.material = "type = \"hypoelastic\"\nyoungs_modulus = 2.0\npoisson_ratio = 0.3";
  body.conditions += "[[boundary]]\nset = \"right\"\ndisplacement = [0.3, 0.1]\n";
  for (const Example& integrator : quasi_static_integrators(6)) {
    INFO(integrator.part, ": ", integrator.table);
    const auto whole = build_run(body, integrator), first = build_run(body, integrator), second = build_run(body, integrator);
    const std::int64_t steps = run(*whole).reports.back().step;
    run(*first, steps / 2);
    second->problem().restore(first->problem().snapshot());
    run(*second);
    CHECK(displacement(*second) == displacement(*whole));
    CHECK(second->problem().state().energies.strain == whole->problem().state().energies.strain);
  }
}
