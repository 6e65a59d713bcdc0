/// Bodies of two materials against closed forms, as laminates and with the materials side by side: a bar, a field that is affine
/// on either side, a round inclusion, layers, a wave that is reflected.

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

/// Relative distance of the displacement from what the columns of the history call exact.
double error(const std::string& scene, int points, const std::string& kinematics, bool laminates,
             std::vector<std::string> more = {}) {
  more.push_back(fmt::format("constants.n={}", points));
  more.push_back("kinematics=" + kinematics);
  more.push_back(fmt::format("family.interfaces=\"{}\"", laminates ? "laminate" : "parallel"));
  more.push_back("run.threads=1");
  const auto simulation = load("interfaces/" + scene + ".toml", std::move(more));
  return error_of_run(*simulation);
}

/// By name, what becomes at least so many times better at n = 20 in the bar.
struct Expected {
  std::string kinematics;
  double bar, shear, inclusion;
};

const std::vector<Expected> expectations{{"\"baqp\"", 30, 8, 4},
                                {"\"projection\"", 15, 3, 4},
                                {"\"bond_associated\"", 20, 5, 4},
                                {"\"bond_augmented\"", 12, 8, 3.5},
                                {"\"sub_horizon\"", 200, 20, 4.5},
                                {"\"non_spherical\"", 20, 4, 5},
                                // Volumes are those of points, which see both sides.
                                {"{type=\"selective\",base=\"baqp\"}", 3.5, 3.8, 2},
                                {"{type=\"selective\",base=\"bond_associated\"}", 5, 5.5, 2.5},
                                // Stabilizations penalise the kink.
                                {"{type=\"conventional\",stabilization=\"wan\"}", 1.6, 1.3, 1.6},
                                {"{type=\"conventional\",stabilization=\"silling\"}", 1.9, 1.4, 1.8}};

}  // namespace

TEST_CASE("interfaces: a bar of two materials, tension and shear across an interface, a round inclusion") {
  for (const Expected& expected : expectations)
    for (const auto& [scene, factor] :
         {std::pair{"bar", expected.bar}, std::pair{"shear", expected.shear}, std::pair{"inclusion", expected.inclusion}}) {
      const double before = error(scene, 20, expected.kinematics, false), after = error(scene, 20, expected.kinematics, true);
      MESSAGE(scene, ", ", expected.kinematics, ": ", before, " side by side, ", after, " as laminates");
      CHECK(after * factor <= before);
    }
}

TEST_CASE("interfaces: the force of a bar of a pair law with a dilatation is that of both halves in series") {
  const auto stored = [](int points, double ratio, bool laminates) {
    std::vector<std::string> overrides{fmt::format("constants.n={}", points), "kinematics={type=\"ordinary\"}", "body.plane=\"stress\"",
                                       fmt::format("region.0.material.youngs_modulus={}", ratio), "run.threads=1"};
    if (ratio != 1) overrides.push_back(fmt::format("family.interfaces=\"{}\"", laminates ? "laminate" : "parallel"));
    const auto simulation = load("interfaces/bar.toml", overrides);
    contract::run(*simulation);
    double energy = 0;
    BodyProblem& problem = simulation->problem();
    Field out = problem.make_field();
    REQUIRE(problem.evaluate_forces({problem.state().displacement(), 0}, out, &energy).ok());
    return energy;
  };
  // The law's own error, 8 % with 20 points, is that of a bar of one material; with one half ten times as stiff it stores 1/(1/2 + 1/20) times as much.
  for (const int points : {20, 40}) {
    const double series = stored(points, 1.0, true) / 0.55, as_laminate = stored(points, 10.0, true) / series - 1, parallel = stored(points, 10.0, false) / series - 1;
    MESSAGE(points, " points: ", 100 * as_laminate, " % in series, ", 100 * parallel, " % side by side");
    CHECK(std::abs(as_laminate) < 2e-3);
    CHECK(parallel > 20 * std::abs(as_laminate));
  }
}

TEST_CASE("interfaces: errors of a round inclusion fall with the spacing") {
  const double coarse = error("inclusion", 20, "\"baqp\"", true), fine = error("inclusion", 80, "\"baqp\"", true);
  MESSAGE("round inclusion: ", coarse, " and ", fine, ", order ", std::log(coarse / fine) / std::log(4.0));
  CHECK(fine * 5 <= coarse);
}

TEST_CASE("interfaces: layers along the load are as stiff as side by side") {
  const auto energy = [](bool laminates) {
    const auto simulation = load("interfaces/bar.toml",
                                 {"constants.n=40", "sets.stiff=\"y < 0.25\"",
                                  fmt::format("family.interfaces=\"{}\"", laminates ? "laminate" : "parallel"), "run.threads=1"});
    contract::run(*simulation);
    double energy = 0;
    BodyProblem& problem = simulation->problem();
    Field force = problem.make_field();
    REQUIRE(problem.evaluate_forces({problem.state().displacement(), 0}, force, &energy).ok());
    return energy;
  };
  CHECK(energy(true) == doctest::Approx(energy(false)).epsilon(1e-12));
  CHECK(energy(true) == doctest::Approx(0.25 * 11 * 0.5e-12).epsilon(1e-10));
}

TEST_CASE("interfaces: a wave is reflected as impedances say, of second order; side by side of first") {
  for (const std::string kinematics : {"\"baqp\"", "\"sub_horizon\"", "\"ordinary\""}) {
    const bool pairs = kinematics == "\"ordinary\"";
    // One modulus is not enough for the pair law in uniaxial strain.
    const std::vector<std::string> more = pairs ? std::vector<std::string>{"body.line=\"stress\""} : std::vector<std::string>{};
    const double coarse = error("wave", 100, kinematics, true, more), fine = error("wave", 200, kinematics, true, more);
    const double order = std::log2(coarse / fine),
                 before = std::log2(error("wave", 100, kinematics, false, more) / error("wave", 200, kinematics, false, more));
    MESSAGE(kinematics, ": errors ", coarse, " and ", fine, ", order ", order, "; side by side order ", before);
    CHECK(order > 1.9);
    CHECK(before < 1.2);
    CHECK(fine < 4e-3);
  }
}

TEST_CASE("interfaces: what cannot be a laminate says so") {
  const auto note = [](const std::vector<std::string>& overrides) {
    const auto simulation = load("interfaces/bar.toml", overrides);
    std::string text;
    for (const auto& [label, line] : simulation->problem().report().notes)
      if (label == "interfaces") text += line;
    return text;
  };
  CHECK(note({}).find("are laminates of two materials") != std::string::npos);
  CHECK(note({"family.interfaces=\"parallel\""}).empty());
  CHECK(note({"kinematics={type=\"selective\",base=\"baqp\"}"}).find("are laminates of two materials") != std::string::npos);
  // A layer of two points is seen from both sides.
  CHECK(note({"sets.stiff=\"abs(x - 0.5) < 0.05\""}).find("thin layers") != std::string::npos);
  // Regions of one material are one material.
  CHECK(note({"region.0.material.youngs_modulus=1.0"}).empty());
}
