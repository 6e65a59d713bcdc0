/// Clouds with balanced weights: the stiffness of a bar, by the reaction at its end, is that of its material.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <string>
#include <vector>

#include "tests/contract/integrator_fixture.hpp"
#include "tests/validation/scenes.hpp"

using namespace perikit;
using namespace perikit::validation;

namespace {

/// Relative error of the force that pulls configs/clouds/bar.toml.
double stiffness_error(const std::string& kinematics, bool consistent, double jitter) {
  const auto simulation =
      load("clouds/bar.toml", {"body.lattice.spacing=0.05", fmt::format("body.lattice.jitter={}", jitter),
                               "kinematics=" + kinematics, fmt::format("family.consistent={}", consistent), "run.threads=1"});
  contract::run(*simulation);
  BodyProblem& problem = simulation->problem();
  Field reaction = problem.make_field();
  REQUIRE(problem.evaluate_forces({problem.state().displacement(), 0}, reaction, nullptr).ok());
  for (double& f : std::span(reaction.data(), reaction.size())) f = -f;
  for (std::size_t k = 0; k < reaction.size(); ++k)
    if (problem.constraints().free().data[k] != 0) reaction.data()[k] = 0;
  problem.images()->gather(reaction);
  double pull = 0;
  for (const std::int32_t p : problem.body().set("right")) pull += reaction.component(0)[p];
  return pull / 0.5 - 1;
}

}  // namespace

TEST_CASE("the stiffness of a bar on a cloud is that of its material") {
  struct Cloud {
    std::string kinematics;
    std::vector<double> jitters;
  };
  for (const auto& [kinematics, jitters] :
       {Cloud{"\"baqp\"", {0.1, 0.3}}, Cloud{"\"projection\"", {0.1, 0.3}}, Cloud{"\"bond_augmented\"", {0.1, 0.3}},
        Cloud{"\"bond_associated\"", {0.1, 0.3}}, Cloud{"\"non_spherical\"", {0.1, 0.3}}, Cloud{"\"sub_horizon\"", {0.1, 0.3}},
        Cloud{"{type=\"conventional\",stabilization=\"wan\"}", {0.1, 0.3}},
        Cloud{"{type=\"conventional\",stabilization=\"silling\"}", {0.1, 0.3}}})
    for (const double jitter : jitters) {
      const double before = stiffness_error(kinematics, false, jitter), after = stiffness_error(kinematics, true, jitter);
      INFO(kinematics, ", jitter ", jitter, ": relative error ", before, " without balanced weights, ", after, " with them");
      CHECK(std::abs(before) > 5e-4);
      CHECK(std::abs(after) < 1e-6);
    }
}

TEST_CASE("points that lie at random are consistent unless a scene says otherwise, and a pair law on them is doubted") {
  const auto summary = [](const std::vector<std::string>& keys) {
    std::vector<std::string> all = {"body.lattice.spacing=0.1", "run.threads=1"};
    all.insert(all.end(), keys.begin(), keys.end());
    return load("clouds/bar.toml", all)->summary();
  };
  CHECK(summary({}).find("weights in ") != std::string::npos);
  CHECK(summary({}).find("too soft") == std::string::npos);
  CHECK(summary({"family.consistent=false"}).find("too soft by 1 to 12 %") != std::string::npos);
  CHECK(summary({"kinematics={type=\"bond_based\",surface_correction=\"none\"}", "output.fields=[\"displacement\"]"}).find("a pair law") != std::string::npos);
  CHECK(summary({"body.lattice.jitter=0.0"}).find("consistency") == std::string::npos);
}
