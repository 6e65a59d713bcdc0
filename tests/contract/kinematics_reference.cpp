/// The engine against the dense reference (framework/reference), which shares no code with it: energies and forces of every
/// kinematics that the reference knows, on lattices and clouds, intact and cracked.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>

#include "tests/contract/fixture.hpp"
#include "tests/contract/reference_body.hpp"

using namespace perikit;
using namespace perikit::contract;

namespace {

std::vector<BodyOptions> bodies() {
  std::vector<BodyOptions> all;
  for (int d = 1; d <= 3; ++d)
    for (const bool cloud : {false, true})
      for (const bool crack : {false, true}) {
        if (crack && d == 1) continue;
        BodyOptions body;
        body.dimension = d;
        body.cloud = cloud;
        body.crack = crack;
        body.cells = d == 3 ? 7 : d == 2 ? 10 : 20;
        all.push_back(body);
      }
  for (const BodyOptions& body : bodies_with_tongues()) all.push_back(body);
  BodyOptions lean;   // small families on a cloud: domains of bonds, and parts, that are needles
  lean.cloud = true;
  lean.cells = 6;
  lean.horizon_ratio = 1.515;
  all.push_back(lean);
  return all;
}

}  // namespace

TEST_CASE("kinematics: agrees with the dense reference") {
  constexpr double tolerance = 1e-11;   // of the largest force; and of the energy
  for (const Example& example : examples(Kind::kinematics)) {
    const auto part = parse_part(Kind::kinematics, example.part, example.table, subject().registry);
    auto description = description_of(*part);
    if (!description) {
      MESSAGE("no dense reference of kinematics '" << example.part << "'");
      continue;
    }
    for (const BodyOptions& options : bodies()) {
      const int order = description->base ? description->base->order : description->order;
      if (options.cloud && options.horizon_ratio < 2 && order > 1) continue;   // hardly any point has bonds enough for it
      INFO(fmt::format("{} ({}) {}D {} m = {}{}", example.part, example.table, options.dimension, options.cloud ? "cloud" : "lattice", options.horizon_ratio,
                       options.crack ? " cracked" : options.tongues ? " with tongues" : ""));
      const auto simulation = build(scene_text(options, kinematics_table(example)));
      BodyProblem& problem = simulation->problem();
      const Body& body = problem.body();
      description->cell = 0;
      set_cell(*part, body, *description);
      deform(body, problem.state().displacement(), 61, 0.02);
      const auto d = static_cast<Eigen::Index>(body.dimension()), n = static_cast<Eigen::Index>(body.points());
      const reference::Vector u = dense(body, problem.state().displacement());
      const auto influence = subject().registry.influence(*simulation->scene().influence);
      const reference::Operator op = reference::build(cloud_of(body, *influence), *description);
      const reference::Vector expected = reference::force(op, saint_venant_kirchhoff(), u);
      const double expected_energy = reference::energy(op, saint_venant_kirchhoff(), u), scale = expected.cwiseAbs().maxCoeff();
      double energy = 0, worst = 0;
      Eigen::Index at = 0;
      REQUIRE(problem.evaluate_forces({problem.state().displacement(), 0}, problem.state().internal_force(), &energy).ok());
      for (Eigen::Index i = 0; i < n; ++i)
        for (Eigen::Index c = 0; c < d; ++c) {
          const double error = std::abs(problem.state().internal_force().component(static_cast<int>(c))[body.internal()[static_cast<std::size_t>(i)]] - expected[d * i + c]);
          if (!(error <= worst)) worst = error, at = i;
        }
      CHECK_MESSAGE(std::abs(energy - expected_energy) <= tolerance * expected_energy, "energy ", energy, ", reference ", expected_energy);
      CHECK_MESSAGE(worst <= tolerance * scale, "force at point ", at, " is off by ", worst, " of ", scale);
    }
  }
}
