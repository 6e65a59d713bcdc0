/// Long rows of a lattice are split between blocks, which then reach into each other's rows, and families of long reach are worked on in pieces: the
/// forces are those of a cloud of the same points.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>

#include "perikit/core/parallel.hpp"
#include "scene/scene.hpp"
#include "tests/contract/integrator_fixture.hpp"
#include "tests/kit/scene_text.hpp"
#include "tests/validation/scenes.hpp"

using namespace perikit;
using namespace perikit::validation;

namespace {

/// Forces and tangent actions (by points in input order) of a body that is `length` long and of `width` cells across.
struct Forces {
  std::vector<double> force, action;
  double energy = 0;
};

Forces forces_of(int dimension, int length, int width, double jitter, const std::string& kinematics, const std::string& more, double ratio = 3.015) {
  std::vector<double> upper{1.0 * length, 1.0 * width, 1.0 * width};
  upper.resize(static_cast<std::size_t>(dimension));
  const std::string across = dimension == 1 ? "" : dimension == 2 ? ", \"0.02*sin(x*y)\"" : ", \"0.02*sin(x*y)\", \"0.01*cos(x + 2*z)\"";
  const auto simulation = build(test::SceneText{.dimension = dimension, .upper = upper, .lattice = fmt::format("jitter = {}\n{}", jitter, more),
                                                .family = fmt::format("horizon_ratio = {}\n{}", ratio, jitter > 0 ? "consistent = false" : ""), .kinematics = kinematics,
                                                .material = "type = \"neo_hookean\"\nshear_modulus = 0.8\nbulk_modulus = 2.0",
                                                .further = fmt::format("[initial]\ndisplacement = [\"0.05*sin(0.3*x) + 0.01*cos(2*x)\"{}]", across)});
  BodyProblem& problem = simulation->problem();
  Forces result;
  Field f = problem.body().make_field(dimension), Kw = problem.body().make_field(dimension);
  REQUIRE(problem.evaluate_forces({problem.state().displacement(), 0}, f, &result.energy).ok());
  REQUIRE(problem.tangent_action({problem.state().displacement(), 0}, problem.state().displacement(), Kw).ok());
  const auto in_input_order = [&](const Field& field, std::vector<double>& out) {
    for (std::size_t i = 0; i < problem.body().points(); ++i)
      for (int c = 0; c < dimension; ++c) out.push_back(field.component(c)[static_cast<std::size_t>(problem.body().internal()[i])]);
  };
  in_input_order(f, result.force);
  in_input_order(Kw, result.action);
  return result;
}

double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  REQUIRE(a.size() == b.size());
  double most = 0, size = 0;
  for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, std::abs(a[i] - b[i])), size = std::max(size, std::abs(b[i]));
  REQUIRE(size > 0);
  return most / size;
}

}  // namespace

TEST_CASE("rows longer than a block") {
  struct Case {
    int dimension, length, width;
    const char* more;
  };
  // Holes in the body: dead cells at and beyond the ends of blocks; a crack: broken bonds across them.
  for (const Case& c : {Case{1, 1500, 1, ""}, {1, 1500, 1, "inside = \"x < 510 || x > 520\"\n"}, {2, 600, 5, "inside = \"(x - 256)^2 + (y - 2)^2 > 4\"\n"},
                        {2, 600, 5, "[[crack]]\nsegment = [[256.0, -1.0], [256.0, 3.0]]\n"}, {3, 530, 3, ""}, {3, 530, 3, "inside = \"x < 248.2 || x > 257.6 || y > 1\"\n"}}) {
    for (const char* kinematics : {"type = \"conventional\"", "type = \"conventional\"\nstabilization = \"wan\"", "type = \"baqp\""}) {
      CAPTURE(c.dimension);
      CAPTURE(c.more);
      CAPTURE(kinematics);
      const Forces lattice = forces_of(c.dimension, c.length, c.width, 0, kinematics, c.more);
      const Forces cloud = forces_of(c.dimension, c.length, c.width, 1e-13, kinematics, c.more);
      CHECK(largest_difference(lattice.force, cloud.force) < 1e-9);
      CHECK(largest_difference(lattice.action, cloud.action) < 1e-9);
      CHECK(lattice.energy == doctest::Approx(cloud.energy).epsilon(1e-10));
    }
  }
}

TEST_CASE("families of hundreds of bonds, and of more cells along a row than kernels keep at once") {
  struct Case {
    int dimension, length, width;
    double ratio;
    const char* kinematics;
  };
  for (const Case& c : {Case{1, 90, 1, 17.2, "type = \"conventional\""}, {2, 50, 22, 17.2, "type = \"conventional\""}, {2, 50, 22, 17.2, "type = \"baqp\""},
                        {3, 10, 7, 4.2, "type = \"selective\"\nbase = \"baqp\""}, {3, 10, 7, 4.2, "type = \"ordinary\"\nsurface_correction = \"none\""}}) {
    CAPTURE(c.dimension);
    CAPTURE(c.kinematics);
    const Forces lattice = forces_of(c.dimension, c.length, c.width, 0, c.kinematics, "", c.ratio);
    const Forces cloud = forces_of(c.dimension, c.length, c.width, 1e-13, c.kinematics, "", c.ratio);
    CHECK(largest_difference(lattice.force, cloud.force) < 1e-9);
    CHECK(largest_difference(lattice.action, cloud.action) < 1e-9);
    CHECK(lattice.energy == doctest::Approx(cloud.energy).epsilon(1e-10));
  }
}
