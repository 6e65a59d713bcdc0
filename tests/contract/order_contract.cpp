/// Point gradients of order 8, for every kinematics that has an `order`: on a line and in the plane, where wide families support
/// it inside and lower orders take over towards the edges.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>

#include "tests/contract/fixture.hpp"
#include "tests/contract/reference_body.hpp"

using namespace perikit;
using namespace perikit::contract;

namespace {

/// Tables with order = 8, of the parts to test and of the stabilizations over them.
std::vector<Example> eighth_order() {
  std::vector<Example> all;
  for (const Example& example : kinematics_examples())
    if (example.table == "order = 2")
      all.push_back({example.part, "order = 8", example.stabilization, example.keeps_angular_momentum});
  return all;
}

/// A line as lattice and cloud, and a plate: on a line the bonds of baqp and projection have their own stretch and nothing of the
/// point gradient.
std::vector<BodyOptions> bodies() {
  std::vector<BodyOptions> all;
  for (const bool cloud : {false, true}) all.push_back({.dimension = 1, .cloud = cloud, .cells = 40, .horizon_ratio = 9.015});
  all.push_back({.dimension = 2, .cells = 14, .horizon_ratio = 5.015});
  return all;
}

std::string label(const Example& example, const BodyOptions& body) {
  return fmt::format("{} ({}) {} {}D {}", example.part, example.table, example.stabilization, body.dimension,
                     body.cloud ? "cloud" : "lattice");
}

}  // namespace

TEST_CASE("kinematics: order 8 is in the operator, with the forces and the tangent that belong to it") {
  for (const Example& example : eighth_order())
    for (const BodyOptions& options : bodies()) {
      INFO(label(example, options));
      const auto simulation = build(scene_text(options, kinematics_table(example)));
      BodyProblem& problem = simulation->problem();
      const Body& body = problem.body();
      deform(body, problem.state().displacement(), 71, 0.02);
      const Derivatives at = derivatives_at(problem, problem.state().displacement(), 72, 2e-3 * body.spacing());
      CHECK(at.force <= 1e-7);
      CHECK(at.tangent <= 1e-7);
      CHECK(at.asymmetry <= 1e-12);
    }
}

TEST_CASE("kinematics: order 8 agrees with the dense reference") {
  // Both go through moment matrices whose eigenvalues lie up to 1e8 apart; the reference inverts them, and loses eight digits of
  // sixteen.
  constexpr double tolerance = 1e-8;
  for (const Example& example : eighth_order())
    for (const BodyOptions& options : bodies()) {
      const auto part = parse_part(Kind::kinematics, example.part, example.table, subject().registry);
      auto description = description_of(*part);
      if (!description || !example.stabilization.empty()) continue;
      INFO(label(example, options));
      const auto simulation = build(scene_text(options, kinematics_table(example)));
      BodyProblem& problem = simulation->problem();
      const Body& body = problem.body();
      set_cell(*part, body, *description);
      deform(body, problem.state().displacement(), 74, 0.02);
      const auto influence = subject().registry.influence(*simulation->scene().influence);
      const reference::Operator op = reference::build(cloud_of(body, *influence), *description);
      const reference::Vector u = dense(body, problem.state().displacement()),
                              expected = reference::force(op, saint_venant_kirchhoff(), u);
      const reference::Vector found = dense(body, force_of(problem, problem.state().displacement()));
      const double worst = (found - expected).cwiseAbs().maxCoeff();
      CHECK_MESSAGE(worst <= tolerance * expected.cwiseAbs().maxCoeff(), "force off by ", worst / expected.cwiseAbs().maxCoeff());
      if (options.dimension == 1 && !formulation_of(example).point) continue;
      // Order 1 gives other forces: the order is not ignored.
      auto first = *description;
      first.order = 1;
      first.cell = 0;
      const reference::Vector other =
          reference::force(reference::build(cloud_of(body, *influence), first), saint_venant_kirchhoff(), u);
      CHECK((found - other).cwiseAbs().maxCoeff() > 1e-3 * expected.cwiseAbs().maxCoeff());
    }
}
