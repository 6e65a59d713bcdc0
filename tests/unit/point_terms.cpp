// Sections [[term]]: what they do to equilibria and motions that are known, and what is refused.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "run/simulation.hpp"
#include "tests/kit/third_party.hpp"

using namespace perikit;
using perikit::test::with_third_parties;

namespace {

std::string plate(const std::string& further, const std::string& integrator) {
  return "format = 1\n[constants]\nk = 0.5\n[body]\ndimension = 2\nplane = \"strain\"\n[body.lattice]\nspacing = 1\nlower = [0, 0]\nupper = [9, 7]\n[sets]\nleft = \"x < 4\"\n"
         "[family]\nhorizon_ratio = 2.515\n[kinematics]\ntype = \"baqp\"\n[material]\ntype = \"saint_venant_kirchhoff\"\nyoungs_modulus = 2.0\npoisson_ratio = 0.25\ndensity = 1\n" +
         further + "\n[integrator]\n" + integrator + "\n";
}

struct Nobody : Observer {
  bool wants_sample(std::int64_t, double) override { return true; }
  void step_done(const StepReport&) override {}
  void log(std::string_view) override {}
};

std::unique_ptr<Simulation> done(const std::string& scene) {
  auto simulation = std::make_unique<Simulation>(parse_scene(scene, "plate.toml", with_third_parties()), with_third_parties());
  Nobody nobody;
  simulation->run(nobody);
  return simulation;
}

std::string refusal(const std::string& scene) {
  try {
    Simulation(parse_scene(scene, "plate.toml", with_third_parties()), with_third_parties());
  } catch (const std::exception& error) {
    return error.what();
  }
  return "nothing";
}

constexpr const char* newton = "type = \"newton\"\nsteps = 4";

}  // namespace

TEST_CASE("term: a body on a foundation moves as force over stiffness, along the normal alone where it has one") {
  // All points alike: nothing is strained.
  for (const std::string kind : {"newton", "jfnk", "kinsol", "dynamic_relaxation"}) {
    INFO(kind);
    const auto simulation = done(plate("[[term]]\ntype = \"foundation\"\nstiffness = \"k\"\nnormal = [0, 3]\n[[term]]\ntype = \"foundation\"\nstiffness = 2\nnormal = [-1, 0]\n"
                                       "[[load]]\nset = \"all\"\nbody_force = [0.4, -0.1]",
                                       "type = \"" + kind + "\"\nsteps = 4"));
    const ConstFieldView u = simulation->problem().state().displacement();
    double worst = 0;
    for (const std::int32_t p : simulation->problem().body().internal()) worst = std::max({worst, std::abs(u.component(0)[p] - 0.2), std::abs(u.component(1)[p] + 0.2)});
    CHECK(worst < 1e-7);
    const Energies& e = simulation->problem().state().energies;
    CHECK(std::abs(e.strain - e.external_work) < 1e-6 * e.strain);
  }
}

TEST_CASE("term: a stiffness that grows with the load parameter puts work into springs that are stretched") {
  const auto simulation = done(plate("[[term]]\ntype = \"foundation\"\nstiffness = \"1 + 3*t\"\n[[load]]\nset = \"all\"\nbody_force = [0.4, 0]", "type = \"newton\"\nsteps = 16"));
  const Energies& e = simulation->problem().state().energies;
  CHECK(std::abs(simulation->problem().state().displacement().component(0)[simulation->problem().body().internal()[0]] - 0.1) < 1e-9);
  CHECK(std::abs(e.strain - 63 * 0.5 * 4 * 0.01) < 1e-9);
  CHECK(std::abs(e.strain - e.external_work) < 1e-12);   // by the trapezoidal rule on both sides
  CHECK(e.dissipated == 0);
}

TEST_CASE("term: a drag stops a body as it should, and what it takes is dissipated") {
  constexpr double c = 0.5, end = 2;
  const auto simulation = done(plate(fmt::format("[[term]]\ntype = \"their_drag\"\ncoefficient = {}\n[initial]\nvelocity = [0.1, 0]", c), fmt::format("type = \"verlet\"\nend_time = {}\ntime_step = 0.005", end)));
  BodyProblem& problem = simulation->problem();
  const std::int32_t p = problem.body().internal()[10];
  CHECK(std::abs(problem.state().velocity().component(0)[p] - 0.1 * std::exp(-c * end)) < 2e-4);
  const Energies& e = problem.state().energies;
  const double start = 63 * 0.5 * 0.01, left = start * std::exp(-2 * c * end);
  CHECK(std::abs(e.dissipated - (start - left)) < 5e-3 * start);
  CHECK(e.dissipated_by_laws == e.dissipated);
  double kinetic = 0;
  for (const std::int32_t q : problem.body().internal()) kinetic += 0.5 * problem.state().velocity().component(0)[q] * problem.state().velocity().component(0)[q];
  CHECK(std::abs(kinetic + e.dissipated - start) < 1e-4 * start);
  CHECK(problem.dissipates());
}

TEST_CASE("term: the stable step knows its stiffness") {
  const auto steps = [](const std::string& term) {
    return done(plate(term + "[initial]\nvelocity = [\"0.01*x\", 0]", "type = \"verlet\"\nend_time = 5.0"))->problem().state().step;
  };
  const std::int64_t free = steps(""), held = steps("[[term]]\ntype = \"foundation\"\nset = \"left\"\nstiffness = 400\n");
  CHECK(free < 30);
  CHECK(held > 50);   // 20 rad/s at the least: 50 steps at the stable step
}

TEST_CASE("term: a body at rest that a term moves has the same bits with and without skipping") {
  const auto moved = [](const std::string& further) {
    const auto simulation = done(plate("[[term]]\ntype = \"their_swirl\"\nset = \"left\"\ncoefficient = 1\n" + further, "type = \"verlet\"\nend_time = 3.0\ntime_step = 0.1"));
    const FieldView u = simulation->problem().state().displacement();
    return std::vector<double>(u.data, u.data + u.size());
  };
  const std::vector<double> with = moved("");
  CHECK(*std::ranges::max_element(with) > 1e-6);
  CHECK(with == moved("[run]\nskip = false\n"));
}

TEST_CASE("term: constants of stiffness are known") {
  const auto constant = [](const std::string& term) {
    const std::string linear = "[material]\ntype = \"linear_elastic\"\n";
    std::string scene = plate(term, "type = \"verlet\"\nend_time = 1.0");
    scene.replace(scene.find("[material]\ntype = \"saint_venant_kirchhoff\"\n"), std::string("[material]\ntype = \"saint_venant_kirchhoff\"\n").size(), linear);
    return Simulation(parse_scene(scene, "plate.toml", with_third_parties()), with_third_parties()).problem().constant_stiffness();
  };
  CHECK(constant(""));
  CHECK(constant("[[term]]\ntype = \"foundation\"\nstiffness = \"1 + x\"\n"));
  CHECK_FALSE(constant("[[term]]\ntype = \"foundation\"\nstiffness = \"1 + t\"\n"));
  CHECK_FALSE(constant("[[term]]\ntype = \"their_swirl\"\ncoefficient = 1\n"));
}

TEST_CASE("term: what is wrong is refused with its place") {
  const auto refused = [](const std::string& term, const std::string& message, const std::string& integrator = newton) {
    const std::string text = refusal(plate(term, integrator));
    CHECK_MESSAGE(text.find(message) != std::string::npos, "no '", message, "' in\n", text);
  };
  refused("[[term]]\ntype = \"foundation\"\n", "plate.toml:22:1: term.0.stiffness: found nothing; allowed: a number >= 0 [N/m^4], or an expression in x, y, z, t");
  refused("[[term]]\nset = \"left\"\n", "plate.toml:22:1: term.0.type: found nothing; allowed: the name of one; known: foundation");
  refused("[[term]]\ntype = \"foundatoin\"\nstiffness = 1\n", "term.0.type: found the unknown term 'foundatoin'; allowed: foundation, their_drag, their_swirl; did you mean 'foundation'?");
  refused("[[term]]\ntype = \"foundation\"\nstiffness = 1\nset = \"lef\"\n", "plate.toml:25:7: term.0.set: found the unknown set \"lef\"; allowed: all, left");
  refused("[[term]]\ntype = \"foundation\"\nstiffness = 1\nnormal = [0, 0]\n", "plate.toml:25:10: term.0.normal: found a vector without a direction");
  refused("[[term]]\ntype = \"foundation\"\nstiffness = 1\nnormal = [0, 0, 1]\n", "term.0.normal");
  refused("[[term]]\ntype = \"foundation\"\nstiffness = 1\nstiff = 2\n", "plate.toml:25:1: term.0.stiff: found an unknown key; allowed: type, stiffness, normal, set");
  refused("[[term]]\ntype = \"foundation\"\nstiffness = \"x - 1\"\n", "plate.toml:24:13: term.0.stiffness: found stiffness = -0.5; allowed: a number >= 0 [N/m^4], at (0.5, ");
  refused("[[term]]\ntype = \"foundation\"\nstiffness = \"0.5 - t\"\n", "term.0.stiffness: found stiffness = -0.5; allowed: a number >= 0 [N/m^4], at (0, 0, 0), t = 1");
  refused("[[term]]\ntype = \"foundation\"\nstiffness = \"q\"\n", "term.0.stiffness: found the expression \"q\": unknown name 'q'");
  refused("[term]\ntype = \"foundation\"\nstiffness = 1\n", "term: found a table; allowed: [[term]], a list of tables");
  refused("[[term]]\ntype = \"their_drag\"\ncoefficient = 1\n", "term.0.type: found \"their_drag\", whose forces depend on the velocity, with integrator \"newton\", whose states have none");
  refused("[[term]]\ntype = \"their_swirl\"\ncoefficient = 1\n[damage]\ntype = \"critical_stretch\"\nstretch = 0.1\n", "term.0.type: found \"their_swirl\", whose forces have no energy, with [damage]");
}

TEST_CASE("term: an equilibrium under forces without energy, whose work comes from outside") {
  Simulation simulation(parse_scene(plate("[[term]]\ntype = \"foundation\"\nstiffness = 2\n[[term]]\ntype = \"their_swirl\"\ncoefficient = 0.5\n"
                                          "[[load]]\nset = \"all\"\nbody_force = [0.1, 0]",
                                          "type = \"newton\"\nsteps = 16"),
                                    "plate.toml", with_third_parties()),
                        with_third_parties());
  struct First final : Nobody {
    explicit First(const State& state) : state(state) {}
    void step_done(const StepReport& report) override {
      if (report.step == 0) strain = state.energies.strain;
    }
    const State& state;
    double strain = 0;
  } first(simulation.problem().state());
  simulation.run(first);
  const Energies& e = simulation.problem().state().energies;
  CHECK(first.strain > 1);
  CHECK(std::abs(e.external_work) > 1e-3);
  CHECK(std::abs(e.strain - first.strain - e.external_work) < 1e-3 * std::abs(e.external_work));
}
