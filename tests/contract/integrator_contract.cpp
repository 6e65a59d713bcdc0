/// What every dynamic integrator must fulfil, with the keys end_time and time_step: second order in time, energy in balance, loads and
/// prescribed motions exact, runs that continue and repeat to the bit. And what an integrator must fulfil that only evaluates.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>

#include "perikit/core/parallel.hpp"
#include "perikit/problem/motion.hpp"
#include "perikit/sdk/stable_step.hpp"
#include "tests/contract/forwarding_problem.hpp"
#include "tests/contract/integrator_fixture.hpp"
#include "tests/kit/observers.hpp"

using namespace perikit;
using namespace perikit::contract;

namespace {

const std::string kinematics = "type = \"baqp\"";
/// For long vibrations on clouds, where a weak corner under `baqp` turns inside out after some hundred periods, in one of ten lengths of the step.
const std::string firm_kinematics = "type = \"bond_associated\"";

bool is_dynamic(const IntegratorTraits& traits) { return traits.dynamic; }
bool only_evaluates(const IntegratorTraits& traits) { return !traits.dynamic && !traits.quasi_static; }

std::vector<Example> dynamic_integrators(double end_time, double time_step) {
  return integrators(is_dynamic, {{"end_time", fmt::format("{:.17g}", end_time)}, {"time_step", fmt::format("{:.17g}", time_step)}});
}

/// A bar (1D) or a plate of two materials, held or moved at `left`.
BodyOptions body_of(int dimension, bool cloud = false) {
  BodyOptions body;
  body.dimension = dimension;
  body.cloud = cloud;
  body.two_materials = true;
  body.cells = dimension == 1 ? 30 : 10;
  body.material += "\ndensity = 3.0";
  body.sets = fmt::format("left = \"x < 2\"\nright = \"x > {}\"\n", dimension == 1 ? 28 : 6);
  return body;
}

std::string vector(int dimension, const std::string& x, const std::string& y) {
  return dimension == 1 ? fmt::format("[{}]", x) : fmt::format("[{}, {}]", x, y);
}

/// Smooth waves, that leave `left` at rest at first.
std::string waves(int d) {
  return "[initial]\nvelocity = " + vector(d, "\"0.006*(x > 2)*(x - 2)\"", "\"0.03*(x > 2)*sin(0.3*(x - 2))\"") + "\n";
}

/// A moving end, and a load that changes.
std::string driven(int d, double factor = 1.0) {
  return fmt::format("[[boundary]]\nset = \"left\"\ndisplacement = {}\n[[load]]\nset = \"right\"\nforce = {}\n",
                     vector(d, fmt::format("\"{}*(1 - cos(0.5*t))\"", 0.05 * factor), "0"),
                     vector(d, fmt::format("\"{}*sin(0.7*t)\"", 0.1 * factor), fmt::format("{}", -0.05 * factor)));
}

std::unique_ptr<Simulation> build_run(BodyOptions body, const Example& integrator, const std::string& of = kinematics) {
  body.integrator = integrator_table(integrator);
  return build(scene_text(body, of));
}

/// The largest step that central differences bear: 2 / omega_max [s].
double stable_step(const BodyOptions& body, const std::string& of = kinematics) {
  const auto simulation = build(scene_text(body, of));
  return 2 / std::sqrt(largest_eigenvalue(simulation->problem(), simulation->problem().state().displacement()));
}

/// Ends the run when it is asked for the `at`-th time whether it is to end within a step; 0: never.
class Signalled final : public test::Silent {
 public:
  explicit Signalled(std::int64_t at = 0) : at_(at) {}
  bool cancelled() const noexcept override { return at_ > 0 && asked >= at_; }
  bool interrupted() const noexcept override { return ++asked == at_; }
  mutable std::int64_t asked = 0;

 private:
  std::int64_t at_;
};

}  // namespace

TEST_CASE("integrator: displacements and energy converge with the square of the time step") {
  for (const int d : {1, 2}) {
    BodyOptions body = body_of(d);
    body.conditions = waves(d) + driven(d);
    const double h = stable_step(body) / 6, end = 40 * h;
    const auto coarse = dynamic_integrators(end, h), middle = dynamic_integrators(end, h / 2), fine = dynamic_integrators(end, h / 16);
    for (std::size_t k = 0; k < coarse.size(); ++k) {
      INFO(coarse[k].part, " ", d, "D");
      const auto a = build_run(body, coarse[k]), b = build_run(body, middle[k]), reference = build_run(body, fine[k]);
      const Watch of_a = run(*a), of_b = run(*b);
      run(*reference);
      const std::vector<double> u = displacement(*reference);
      // With e = c h^2 the errors against the fine run stand as (1 - 1/256) to (1/4 - 1/256).
      const double ratio = difference(displacement(*a), u) / difference(displacement(*b), u);
      CHECK_MESSAGE((ratio > 3.5 && ratio < 4.6), "half the step divides the error by ", ratio, ", expected 4.05");
      CHECK_MESSAGE(difference(displacement(*a), u) < 0.02 * largest(u), "error of the coarse run ", difference(displacement(*a), u), " of ", largest(u));
      const double balance = of_a.imbalance() / of_b.imbalance();
      CHECK_MESSAGE((balance > 3.3 && balance < 4.8), "half the step divides the energy error by ", balance, ", expected 4");
      CHECK_MESSAGE(of_a.imbalance() < 0.02 * of_a.energies.back().kinetic, "energy error ", of_a.imbalance(), " of ", of_a.energies.back().kinetic);
    }
  }
}

TEST_CASE("integrator: points may move before forces are evaluated, or as they are") {
  for (const int d : {1, 2})
    for (const bool cloud : {false, true}) {
      BodyOptions body = body_of(d, cloud);
      body.cells = d == 1 ? 700 : 40;
      body.conditions = waves(d) + driven(d);
      const std::string of = "type = \"conventional\"";
      const double h = stable_step(body, of) / 6;
      for (const Example& integrator : dynamic_integrators(30 * h, h)) {
        INFO(integrator.part, " ", d, "D", std::string(cloud ? " cloud" : " lattice"));
        const auto at_once = build_run(body, integrator, of), before = build_run(body, integrator, of);
        run(*at_once);
        ForwardingProblem forwarding(before->problem());   // which does not move points itself
        Watch watch(*before);
        before->integrator().run(forwarding, watch);
        CHECK(state(*at_once) == state(*before));
      }
    }
}

TEST_CASE("integrator: the energy of free vibration does not drift") {
  for (const bool cloud : {false, true}) {
    BodyOptions body = body_of(2, cloud);
    body.conditions = waves(2);
    const std::string& of = cloud ? firm_kinematics : kinematics;
    const double h = stable_step(body, of) / 3;
    for (const Example& integrator : dynamic_integrators(3000 * h, h)) {
      INFO(integrator.part, std::string(cloud ? " cloud" : " lattice"));
      const auto simulation = build_run(body, integrator, of);
      const Watch watch = run(*simulation);
      const std::size_t n = watch.energies.size(), third = n / 3;
      const double early = watch.imbalance(0, third), whole = watch.imbalance();
      CHECK_MESSAGE(whole < 1.5 * early, "energy error grows from ", early, " in the first third to ", whole);
      CHECK_MESSAGE(whole < 0.01 * watch.energies.front().kinetic, "energy error ", whole, " of ", watch.energies.front().kinetic);
    }
  }
}

TEST_CASE("integrator: equal steps, none longer than asked for, hit the end time exactly") {
  BodyOptions body = body_of(1);
  body.conditions = waves(1) + driven(1);
  const double h = stable_step(body) / 3;
  for (const double steps : {1.0, 7.0, 7.3, 200.0}) {
    const double end = steps * h;
    for (const Example& integrator : dynamic_integrators(end, h)) {
      INFO(integrator.part, ", ", steps, " steps");
      const auto simulation = build_run(body, integrator);
      const Watch watch = run(*simulation);
      const double expected = std::ceil(steps * (1 - 1e-9));
      REQUIRE(watch.reports.size() == static_cast<std::size_t>(expected) + 1);
      CHECK(watch.reports.back().time == end);
      CHECK(simulation->problem().state().time == end);
      for (std::size_t k = 0; k < watch.reports.size(); ++k) {
        const StepReport& report = watch.reports[k];
        CHECK(report.step == static_cast<std::int64_t>(k));
        CHECK(report.end_time == end);
        CHECK(report.steps_expected == static_cast<std::int64_t>(expected));
        CHECK(std::abs(report.time - end * static_cast<double>(k) / expected) <= 1e-14 * end);
        CHECK(report.time_step <= h * (1 + 1e-12));
      }
    }
  }
}

TEST_CASE("integrator: prescribed motions are exact") {
  BodyOptions body = body_of(2);
  body.conditions = "[initial]\ndisplacement = [\"0.01*x\", 0]\nvelocity = [\"0.02*(x > 6)\", 0]\n"
                    "[[boundary]]\nset = \"left\"\ndisplacement = [\"0.01*x*cos(0.4*t)\", 0.0]\n"
                    "[[boundary]]\nset = \"right\"\nvelocity = [\"0.02 - 0.0004*t\", \"free\"]\n";
  const double h = stable_step(body) / 2, end = 60 * h;
  for (const Example& integrator : dynamic_integrators(end, h)) {
    INFO(integrator.part);
    const auto simulation = build_run(body, integrator);
    BodyProblem& problem = simulation->problem();
    const Body& state_of = problem.body();
    Watch watch(*simulation);
    double displaced = 0, moved = 0, speed = 0;
    watch.each = [&](const StepReport& report) {
      const double t = report.time;
      for (const std::int32_t p : state_of.set("left")) {
        const double x = state_of.position(static_cast<std::size_t>(p))[0];
        displaced = std::max(displaced, std::abs(problem.state().displacement().component(0)[p] - 0.01 * x * std::cos(0.4 * t)));
        displaced = std::max(displaced, std::abs(problem.state().displacement().component(1)[p]));
      }
      for (const std::int32_t p : state_of.set("right")) {
        const double x = state_of.position(static_cast<std::size_t>(p))[0];
        moved = std::max(moved, std::abs(problem.state().displacement().component(0)[p] - 0.01 * x - 0.02 * t + 0.0002 * t * t));
        speed = std::max(speed, std::abs(problem.state().velocity().component(0)[p] - 0.02 + 0.0004 * t));
      }
    };
    simulation->run(watch);
    CHECK_MESSAGE(displaced <= 1e-15, "a prescribed displacement is missed by ", displaced);
    CHECK_MESSAGE(moved <= 1e-13, "a velocity that is linear in time does not integrate to its displacement: ", moved);
    CHECK_MESSAGE(speed <= 1e-13, "a prescribed velocity is missed by ", speed);
  }
}

TEST_CASE("integrator: a constant load gives a free body its momentum, and work is force times distance") {
  for (const bool cloud : {false, true}) {
    BodyOptions body = body_of(2, cloud);
    body.conditions = waves(2) + "[[load]]\nset = \"right\"\nforce = [0.03, -0.02]\n";
    const double h = stable_step(body) / 2, end = 150 * h;
    for (const Example& integrator : dynamic_integrators(end, h)) {
      INFO(integrator.part, std::string(cloud ? " cloud" : " lattice"));
      const auto simulation = build_run(body, integrator);
      BodyProblem& problem = simulation->problem();
      const auto momentum = [&](int c) {
        double sum = 0;
        for (const std::int32_t p : problem.body().internal()) sum += problem.masses().by_point()[static_cast<std::size_t>(p)] * problem.state().velocity().component(c)[p];
        return sum;
      };
      const double before[2] = {momentum(0), momentum(1)}, force[2] = {0.03, -0.02};
      run(*simulation);
      for (const int c : {0, 1}) {
        const double gained = momentum(c) - before[c];
        CHECK_MESSAGE(std::abs(gained - force[c] * end) <= 1e-12 * (std::abs(before[c]) + std::abs(force[c]) * end), "momentum gained ", gained, ", expected ", force[c] * end);
      }
      // Nothing moves at first: the displacement at the end is the distance.
      const double work = dot(problem.body(), problem.state().external_force(), problem.state().displacement());
      CHECK_MESSAGE(std::abs(problem.state().energies.external_work - work) <= 1e-12 * std::abs(work), "work ", problem.state().energies.external_work, ", force times distance ", work);
    }
  }
}

TEST_CASE("integrator: reactions carry loads and inertia") {
  BodyOptions body = body_of(2);
  // Both ends accelerate alike: inertia is no small part of the reactions, however long the way.
  body.conditions = "[[boundary]]\nset = \"left\"\ndisplacement = [\"5e-7*t^2\", \"free\"]\n[[boundary]]\nset = \"right\"\nvelocity = [\"1e-6*t\", 0]\n"
                    "[[load]]\nset = \"all\"\nbody_force = [\"1e-6*cos(t)\", 2e-6]\n";
  const double h = stable_step(body) / 2, end = 2000 * h;
  for (const Example& integrator : dynamic_integrators(end, h)) {
    INFO(integrator.part);
    const auto simulation = build_run(body, integrator);
    run(*simulation, 1000);
    BodyProblem& problem = simulation->problem();
    const Body& b = problem.body();
    const Field reaction = reactions(problem, true, problem.state().time);
    const double scale = largest(b, reaction);
    double worst = 0;
    const auto check = [&](const std::string& set, int c, double acceleration) {
      for (const std::int32_t p : b.set(set)) {
        const double others = problem.state().internal_force().component(c)[p] + problem.state().external_force().component(c)[p];
        worst = std::max(worst, std::abs(reaction.component(c)[p] + others - problem.masses().by_point()[static_cast<std::size_t>(p)] * acceleration));
      }
    };
    check("left", 0, 1e-6);
    check("right", 0, 1e-6);
    check("right", 1, 0.0);
    CHECK_MESSAGE(worst <= 1e-8 * scale, "reaction is not m a - internal - external: ", worst, " of ", scale);
    const ConstFieldView free = problem.constraints().free();
    for (std::size_t k = 0; k < free.size(); ++k) {
      if (free.data[k] == 1.0) CHECK_MESSAGE(reaction.data()[k] == 0.0, "a free component has a reaction");
    }
    // Internal forces cancel: reactions and loads alone accelerate the body.
    const Field acceleration = accelerations(problem, problem.state().time);
    for (const int c : {0, 1}) {
      double inertia = 0;
      for (const std::int32_t p : b.internal()) inertia += problem.masses().by_point()[static_cast<std::size_t>(p)] * acceleration.component(c)[p];
      CHECK(std::abs(total(b, reaction, c) + total(b, problem.state().external_force(), c) - inertia) <= 1e-10 * scale * static_cast<double>(b.points()));
    }
  }
}

TEST_CASE("integrator: a run that continues from a saved state is bitwise the run without a stop") {
  for (const bool cloud : {false, true})
    for (const bool estimated : {false, true}) {
      BodyOptions body = body_of(2, cloud);
      body.conditions = waves(2) + driven(2, 0.1);
      const double h = stable_step(body) / 2, end = (estimated ? 1300 : 130) * h;
      const std::string end_text = fmt::format("{:.17g}", end);
      for (const Example& integrator : estimated ? integrators(is_dynamic, {{"end_time", end_text}}) : dynamic_integrators(end, h)) {
        // An example's own step has nothing to do with this body.
        if (estimated && integrator.table.find("time_step") != std::string::npos) continue;
        INFO(integrator.part, " ", integrator.table, std::string(cloud ? " cloud" : " lattice"));
        const auto whole = build_run(body, integrator), first = build_run(body, integrator), second = build_run(body, integrator);
        const std::int64_t steps = run(*whole).reports.back().step, half = steps / 2;
        run(*first, half);
        REQUIRE(first->problem().state().step == half);
        const std::vector<std::byte> saved = first->problem().snapshot();
        second->problem().restore(saved);
        CHECK(second->problem().snapshot() == saved);
        const Watch rest = run(*second);
        CHECK_MESSAGE(rest.reports.front().step == half + 1, "a continued run begins with step ", rest.reports.front().step, " after ", half);
        CHECK(second->problem().state().time == end);
        CHECK_MESSAGE(state(*second) == state(*whole), "the continued run differs by ", difference(state(*second), state(*whole)));
        // The same simulation can also go on in memory.
        run(*first);
        CHECK_MESSAGE(state(*first) == state(*whole), "the run that was stopped and went on differs by ", difference(state(*first), state(*whole)));
        CHECK_THROWS_AS(build_run(body, integrator)->problem().restore(std::span(saved).first(saved.size() - 9)), InputError);
        CHECK_THROWS_AS(build_run(body_of(1), integrator)->problem().restore(saved), InputError);
      }
    }
}

TEST_CASE("integrator: a run that a signal ends within an estimate of its step goes on as without") {
  BodyOptions body = body_of(2);
  body.conditions = waves(2) + driven(2, 0.1);
  const std::string end = fmt::format("{:.17g}", 650 * stable_step(body));
  for (const Example& integrator : integrators(is_dynamic, {{"end_time", end}})) {
    if (integrator.table.find("time_step") != std::string::npos) continue;
    INFO(integrator.part, " ", integrator.table);
    const auto whole = build_run(body, integrator);
    Signalled never;
    whole->run(never);
    for (const std::int64_t at : {std::int64_t{1}, never.asked / 2, never.asked}) {
      if (at == 0 || at > never.asked) continue;   // it asks for nothing within its run
      const auto first = build_run(body, integrator), second = build_run(body, integrator);
      Signalled stopped(at);
      first->run(stopped);
      CHECK(stopped.asked == at);
      REQUIRE(first->problem().state().step < whole->problem().state().step);
      second->problem().restore(first->problem().snapshot());
      Signalled rest;
      second->run(rest);
      CHECK_MESSAGE(state(*second) == state(*whole), "the run differs by ", difference(state(*second), state(*whole)));
    }
  }
}

TEST_CASE("integrator: bitwise the same for one and two threads") {
  for (const bool cloud : {false, true}) {
    BodyOptions body = body_of(2, cloud);
    body.cells = 110;
    body.conditions = waves(2) + driven(2);
    for (const Example& integrator : dynamic_integrators(6.0, 0.3)) {
      INFO(integrator.part, std::string(cloud ? " cloud" : " lattice"));
      const int threads = thread_count();
      std::vector<double> states[2];
      for (const int n : {1, 2}) {
        set_thread_count(n);
        const auto simulation = build_run(body, integrator);
        run(*simulation);
        states[n - 1] = state(*simulation);
      }
      set_thread_count(threads);
      CHECK_MESSAGE(states[0] == states[1], "states differ by ", difference(states[0], states[1]));
    }
  }
}

TEST_CASE("integrator: an inadmissible deformation ends the run where it arises") {
  BodyOptions body = body_of(2);
  body.two_materials = false;
  body.material = "type = \"neo_hookean\"\ndensity = 1.0\nshear_modulus = 1.0\nbulk_modulus = 2.0";
  body.conditions = "[initial]\nvelocity = [\"-100*(x > 6)\", 0]\n";
  for (const Example& integrator : dynamic_integrators(10.0, 0.1)) {
    INFO(integrator.part);
    const auto simulation = build_run(body, integrator);
    std::string message;
    try {
      run(*simulation);
    } catch (const RunError& error) {
      message = error.what();
    }
    for (const std::string word : {"point", "step", "time", "baqp", "neo_hookean"}) CHECK_MESSAGE(message.find(word) != std::string::npos, "no '", word, "' in: ", message);
  }
}

TEST_CASE("integrator: an evaluation leaves the initial displacement alone and sums its energy") {
  for (const bool cloud : {false, true}) {
    BodyOptions body = body_of(2, cloud);
    body.conditions = "[initial]\ndisplacement = [\"0.02*x + 0.01*sin(y)\", \"-0.01*x*y\"]\n[[boundary]]\nset = \"left\"\ndisplacement = [5, 5]\n"
                      "[[load]]\nset = \"right\"\nforce = [0.25, 0]\n";
    for (const Example& integrator : integrators(only_evaluates, {})) {
      INFO(integrator.part, std::string(cloud ? " cloud" : " lattice"));
      const auto simulation = build_run(body, integrator);
      BodyProblem& problem = simulation->problem();
      const std::vector<double> before = displacement(*simulation);
      const Watch watch = run(*simulation);
      REQUIRE(watch.reports.size() == 1);
      CHECK(watch.reports[0].step == 0);
      CHECK(displacement(*simulation) == before);
      Field force = problem.body().make_field(2);
      double energy = 0;
      REQUIRE(problem.evaluate_forces({problem.state().displacement(), 0}, force, &energy).ok());
      CHECK(problem.state().energies.strain == energy);
      CHECK(energy > 0);
      CHECK(std::equal(force.data(), force.data() + force.size(), problem.state().internal_force().data));
      PointSamples samples;
      REQUIRE(problem.terms().sample({problem.state().displacement(), 0}, samples).ok());
      double sum = 0;
      for (const std::int32_t p : problem.body().internal()) sum += samples.strain_energy_density.data()[p] * problem.body().volume(static_cast<std::size_t>(p));
      CHECK(std::abs(sum - energy) <= 1e-13 * energy);
      CHECK(std::abs(total(problem.body(), problem.state().external_force(), 0) - 0.25) <= 1e-15);
    }
  }
}
