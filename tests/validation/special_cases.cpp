/// Formulations that must coincide (Hu et al., A unified framework of bond-associated correspondence models), through the engine.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>

#include "tests/validation/scenes.hpp"

using namespace perikit;
using namespace perikit::validation;
using contract::BodyOptions;

namespace {

struct Response {
  double energy = 0;
  Field force;
};

Response respond(BodyProblem& problem) {
  Response r{0, problem.make_field(problem.dimension())};
  const EvaluationStatus status = problem.evaluate_forces(problem.displacement(), r.force, &r.energy);
  REQUIRE_MESSAGE(status.ok(), status.description);
  return r;
}

/// Energies and forces of two kinematics in the same finite, noisy deformation.
void check_same(const BodyOptions& options, const std::string& a, const std::string& b) {
  registry();
  INFO(a, " against ", b, ", ", options.dimension, "D ", options.influence, options.crack ? " cracked" : "");
  const auto one = contract::build(contract::scene_text(options, a)), two = contract::build(contract::scene_text(options, b));
  for (const auto& simulation : {one.get(), two.get()}) {
    contract::deform(simulation->problem().body(), simulation->problem().displacement(), 61, 0.02);
  }
  const Response r = respond(one->problem()), s = respond(two->problem());
  const Body& body = one->problem().body();
  double worst = 0;
  for (const std::int32_t p : body.internal())
    for (int c = 0; c < body.dimension(); ++c) worst = std::max(worst, std::abs(r.force.component(c)[p] - s.force.component(c)[p]));
  CHECK_MESSAGE(std::abs(r.energy - s.energy) <= 1e-12 * s.energy, r.energy, " against ", s.energy);
  CHECK_MESSAGE(worst <= 1e-11 * contract::largest(body, s.force), "forces differ by ", worst, " of ", contract::largest(body, s.force));
}

}  // namespace

TEST_CASE("bond_augmented with lambda = 1 is the conventional model") {
  for (int d = 1; d <= 3; ++d)
    for (const char* influence : {"constant", "gaussian"})
      for (const bool crack : {false, true}) {
        // The conventional model degrades with the influence that it loses, as bonds do that weigh by it.
        const BodyOptions cloud{.dimension = d, .cloud = true, .crack = crack && d > 1, .influence = influence};
        check_same(cloud, "type = \"bond_augmented\"\nlambda = 1.0\nweight = \"kernel\"", "type = \"conventional\"");
      }
}

TEST_CASE("non_spherical with n1 = n2 = 0 is the conventional model with a constant kernel") {
  for (int d = 1; d <= 3; ++d)
    for (const bool crack : {false, true}) {
      const BodyOptions cloud{.dimension = d, .cloud = true, .crack = crack && d > 1, .influence = "constant"};
      check_same(cloud, "type = \"non_spherical\"\nn1 = 0.0\nn2 = 0.0", "type = \"conventional\"");
    }
}

TEST_CASE("bond_associated with a bond horizon of twice the horizon is the conventional model") {
  for (int d = 1; d <= 3; ++d)
    for (const char* influence : {"constant", "gaussian"}) {
      const BodyOptions cloud{.dimension = d, .cloud = true, .influence = influence};
      check_same(cloud, "type = \"bond_associated\"\nbond_horizon_ratio = 2.0", "type = \"conventional\"");
    }
}

TEST_CASE("projection with weight = \"kernel\" and baqp coincide where the point gradient is uniform and families are whole") {
  // Nine layers of points lie around the middle one: all that its force depends on is whole.
  for (const char* influence : {"constant", "cubic_spline", "gaussian"}) {
    INFO(influence);
    const auto run = [&](const char* kinematics) {
      return load("partmann/checkerboard.toml", {fmt::format("kinematics={}", kinematics), fmt::format("family.influence={}", influence),
                                                 "body.lattice.upper=[462.5, 462.5, 462.5]", "sets.inside={ nearest = [225, 225, 225] }"});
    };
    const auto one = run("{ type = \"projection\", weight = \"kernel\" }"), two = run("{ type = \"baqp\" }");
    const Response r = respond(one->problem()), s = respond(two->problem());
    PointSamples a, b;
    REQUIRE(one->problem().model().sample(one->problem().displacement(), a).ok());
    REQUIRE(two->problem().model().sample(two->problem().displacement(), b).ok());
    const std::int32_t p = two->problem().body().set("inside").front();
    const double density = b.strain_energy_density.data()[p];
    CHECK(std::abs(a.strain_energy_density.data()[p] - density) <= 1e-12 * density);
    double worst = 0, scale = 0;
    for (int c = 0; c < 3; ++c) {
      worst = std::max(worst, std::abs(r.force.component(c)[p] - s.force.component(c)[p]));
      scale = std::max(scale, std::abs(s.force.component(c)[p]));
    }
    CHECK(scale > 0);
    CHECK_MESSAGE(worst <= 1e-11 * scale, "forces differ by ", worst, " of ", scale);
  }
}
