/// What every quasi-static integrator must fulfil where bonds fail: they fail at equilibria only and for good, every step ends in
/// equilibrium with the bonds that are left, energy is accounted for, the crack is that of another integrator, and a run goes on
/// bitwise after a stop.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "perikit/problem/motion.hpp"
#include "tests/contract/integrator_fixture.hpp"
#include "tests/contract/witness_problem.hpp"

using namespace perikit;
using namespace perikit::contract;

namespace {

constexpr double tolerance = 1e-10;
const std::string brittle = "[damage]\ntype = \"critical_stretch\"\nsecond_law = false\nstretch = 0.04\n",
                  gradual = "[damage]\ntype = \"smooth_degradation\"\nsecond_law = false\nstretch_min = 0.02\nstretch = 0.06\n";

std::vector<Example> quasi_static_integrators() {
  return integrators([](const IntegratorTraits& traits) { return traits.quasi_static; },
                     {{"steps", "6"}, {"tolerance", fmt::format("{}", tolerance)}, {"max_iterations", "50000"}});
}

/// A plate that is cut a third of the way up and pulled apart: the crack runs on.
BodyOptions plate(const std::string& damage, bool cloud = false) {
  BodyOptions body;
  body.dimension = 2;
  body.cloud = cloud;
  body.cells = 12;
  body.sets = "left = \"x < 2\"\nright = \"x > 8\"\n";
  body.conditions = damage +
                    "no_fail = [\"left\", \"right\"]\n[[crack]]\nsegment = [[5.013, -1], [5.013, 4.4]]\n[[boundary]]\nset = "
                    "\"left\"\ndisplacement = [0, 0]\n"
                    "[[boundary]]\nset = \"right\"\ndisplacement = [0.24, 0]\n";
  return body;
}

std::unique_ptr<Simulation> build_run(BodyOptions body, const std::string& integrator, const std::string& kinematics) {
  body.integrator = integrator;
  return build(scene_text(body, kinematics));
}

using Bonds = std::map<std::pair<std::int32_t, std::int32_t>, double>;

/// Integrity of the bonds that have failed, by their ends.
Bonds failed(const BodyProblem& problem) {
  Bonds bonds;
  for (const BondChange& b : problem.families().changed())
    bonds[{b.bond.point, b.bond.far}] = b.integrity;
  return bonds;
}

double stretch(BodyProblem& problem, std::int32_t p, std::int32_t q) {
  const Point x = problem.body().position(static_cast<std::size_t>(p)), y = problem.body().position(static_cast<std::size_t>(q));
  double before = 0, now = 0;
  for (std::size_t c = 0; c < 2; ++c) {
    const int k = static_cast<int>(c);
    const double xi = y[c] - x[c], eta = xi + problem.state().displacement().component(k)[q] - problem.state().displacement().component(k)[p];
    before += xi * xi;
    now += eta * eta;
  }
  return std::sqrt(now / before) - 1;
}

/// Pairs within the horizon, none of them held, that the cut does not part.
std::vector<std::pair<std::int32_t, std::int32_t>> free_bonds(const Body& body) {
  std::vector<std::pair<std::int32_t, std::int32_t>> pairs;
  for (const std::int32_t p : body.internal())
    for (const std::int32_t q : body.internal()) {
      const Point x = body.position(static_cast<std::size_t>(p)), y = body.position(static_cast<std::size_t>(q));
      const bool held = std::min(x[0], y[0]) < 2 || std::max(x[0], y[0]) > 8,
                 cut = (x[0] < 5.013) != (y[0] < 5.013) && std::min(x[1], y[1]) < 4.4;
      if (p < q && !held && !cut && std::hypot(y[0] - x[0], y[1] - x[1]) <= body.horizon()) pairs.emplace_back(p, q);
    }
  return pairs;
}

/// Largest force on a free component, in units of the largest reaction of the whole run.
double unbalanced(BodyProblem& problem, double& reaction) {
  const ConstFieldView free = problem.constraints().free();
  reaction = std::max(reaction, largest(problem.body(), reactions(problem, false, problem.state().time)));
  double most = 0;
  Field force = problem.body().make_field(2);
  REQUIRE(problem.evaluate_forces({problem.state().displacement(), 0}, force, nullptr).ok());
  for (std::size_t k = 0; k < free.size(); ++k)
    if (free.data[k] == 1.0) most = std::max(most, std::abs(force.data()[k]));
  return most / reaction;
}

const std::vector<std::string> shapes{"type = \"baqp\"",
                                      "type = \"bond_based\"",
                                      "type = \"ordinary\"",
                                      "type = \"conventional\"",
                                      "type = \"conventional\"\nstabilization = \"silling\"",
                                      "type = \"sub_horizon\"",
                                      "type = \"bond_associated\"",
                                      "type = \"selective\"\nbase = { type = \"projection\" }"};

}  // namespace

TEST_CASE(
    "integrator: bonds fail at equilibria, for good, beyond their limits, and steps end in equilibrium with those that are "
    "left") {
  std::string first;
  for (const Example& integrator : quasi_static_integrators())
    for (const std::string& kinematics : shapes)
      for (const std::string& damage : {brittle, gradual}) {
        // Every shape with the first example of an integrator, one with the others.
        if (first.empty()) first = integrator.table;
        if (integrator.table != first && kinematics != shapes.front()) continue;
        INFO(integrator.part, " (", integrator.table, "), ", kinematics, ", ", damage);
        const auto simulation = build_run(plate(damage), integrator_table(integrator), kinematics);
        BodyProblem& problem = simulation->problem();
        const bool bits = damage == brittle;
        const double onset = bits ? 0.04 : 0.02, failure = bits ? 0.04 : 0.06;
        Watch watch(*simulation);
        WitnessProblem witness(problem);
        Bonds known;
        double reaction = 0, residual = 0, at_failure = 0, dissipated = 0;
        int failing = 0;
        witness.before = [&] { at_failure = std::max(at_failure, unbalanced(problem, reaction)); };
        witness.after = [&] {
          const Bonds now = failed(problem);
          const Field lost = problem.terms().damage();
          for (const auto& [bond, b] : known) CHECK((now.contains(bond) && now.at(bond) <= b));
          for (const auto& [bond, b] : now) {
            CHECK((b >= 0 && b < 1));
            // Points that are left with too few bonds for a gradient lose the others too.
            const bool fragment =
                problem.terms().has_gradients() && (lost.data()[bond.first] == 1 || lost.data()[bond.second] == 1);
            if (!known.contains(bond) && !fragment) CHECK(stretch(problem, bond.first, bond.second) > onset * (1 - 1e-9));
          }
          failing += now != known;
          known = now;
        };
        watch.each = [&](const StepReport&) {
          residual = std::max(residual, unbalanced(problem, reaction));
          CHECK(failed(problem) == known);
          // Not so where families without a penalty against zero-energy modes change: run.log counts what that adds.
          if (problem.fracture_summary().find("raised") == std::string::npos) CHECK(problem.state().energies.dissipated >= dissipated);
          dissipated = problem.state().energies.dissipated;
          // What is stretched beyond the limit has failed.
          for (const auto& [p, q] : free_bonds(problem.body()))
            if (stretch(problem, p, q) > failure * (1 + 1e-5)) CHECK((known.contains({p, q}) && known.at({p, q}) == 0));
        };
        simulation->integrator().run(witness, watch);
        CHECK(watch.reports.back().time == 1.0);
        CHECK_MESSAGE(at_failure <= 1000 * tolerance, "bonds fail where a free component has a force of ", at_failure,
                      " of the largest reaction");
        CHECK_MESSAGE(residual <= 1000 * tolerance, "a step leaves a free component a force of ", residual,
                      " of the largest reaction");
        CHECK(failing > 3);
        CHECK(std::any_of(known.begin(), known.end(), [](const auto& bond) { return bond.second == 0; }));
        CHECK(std::any_of(known.begin(), known.end(), [](const auto& bond) { return bond.second > 0; }) == !bits);
        CHECK(known.size() < problem.report().bonds / 4);
        const Energies& e = problem.state().energies;
        CHECK(e.dissipated > 0);
        CHECK_MESSAGE(std::abs(e.external_work - e.strain - e.dissipated) <= 0.01 * e.external_work, "work ", e.external_work,
                      ", stored ", e.strain, ", dissipated ", e.dissipated);
      }
}

TEST_CASE("integrator: the crack of a quasi-static run is that of another integrator") {
  for (const std::string& kinematics : {shapes[0], shapes[1]})
    for (const bool cloud : {false, true}) {
      const std::string table = fmt::format("type = \"newton\"\nsteps = 6\ntolerance = {}", tolerance);
      const auto reference = build_run(plate(brittle, cloud), table, kinematics);
      run(*reference);
      const Bonds expected = failed(reference->problem());
      CHECK(!expected.empty());
      for (const Example& integrator : quasi_static_integrators()) {
        INFO(integrator.part, " (", integrator.table, "), ", kinematics, cloud ? " cloud" : " lattice");
        const auto simulation = build_run(plate(brittle, cloud), integrator_table(integrator), kinematics);
        run(*simulation);
        CHECK(failed(simulation->problem()) == expected);
        const std::vector<double> u = displacement(*reference);
        CHECK_MESSAGE(difference(displacement(*simulation), u) <= 1e-6 * largest(u), "moved by ",
                      difference(displacement(*simulation), u));
        CHECK(simulation->problem().state().energies.dissipated ==
              doctest::Approx(reference->problem().state().energies.dissipated).epsilon(1e-6));
      }
    }
}

TEST_CASE("integrator: a quasi-static run with failing bonds that is stopped goes on bitwise") {
  for (const Example& integrator : quasi_static_integrators())
    for (const std::string& damage : {brittle, gradual}) {
      INFO(integrator.part, " (", integrator.table, "), ", damage);
      const std::string table = integrator_table(integrator), kinematics = "type = \"baqp\"";
      const auto whole = build_run(plate(damage), table, kinematics);
      std::vector<std::int64_t> breaking;  // steps after which bonds have failed
      Watch watch(*whole);
      std::size_t before = 0;
      watch.each = [&](const StepReport& report) {
        const std::size_t now = whole->problem().families().changed().size();
        if (now > before) breaking.push_back(report.step);
        before = now;
      };
      whole->run(watch);
      REQUIRE(!breaking.empty());
      for (const std::int64_t step : {breaking.front() - 1, breaking.front()}) {
        const auto first = build_run(plate(damage), table, kinematics), second = build_run(plate(damage), table, kinematics);
        run(*first, step);
        second->problem().restore(first->problem().snapshot());
        run(*second);
        CHECK(state(*second) == state(*whole));
        CHECK(failed(second->problem()) == failed(whole->problem()));
      }
    }
}
