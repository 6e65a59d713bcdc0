#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "perikit/plugin/registry.hpp"
#include "perikit/run/simulation.hpp"

using namespace perikit;

namespace {

std::unique_ptr<Simulation> plate(const std::string& set, double jitter, const std::string& load, const std::string& kinematics = "type = \"conventional\"",
                                  const std::string& further = "") {
  static Registry registry;
  if (registry.names(Kind::kinematics).empty()) registry.add_folder(PERIKIT_PLUGIN_FOLDER);
  const std::string text = fmt::format(
      "format = 1\n[body]\ndimension = 2\nplane = \"strain\"\nthickness = 2.0\n[body.lattice]\nspacing = 0.5\nlower = [0, 0]\nupper = [6, 5]\njitter = {}\n"
      "[sets]\nright = \"{}\"\n[family]\nhorizon_ratio = 3.015\n[kinematics]\n{}\n"
      "[material]\ntype = \"saint_venant_kirchhoff\"\nyoungs_modulus = 1.0\npoisson_ratio = 0.25\n"
      "[[load]]\nset = \"right\"\n{}\n{}[integrator]\ntype = \"evaluate\"\n",
      jitter, set, kinematics, load, further);
  return std::make_unique<Simulation>(parse_scene(text, "plate.toml", registry), registry);
}

struct Resultant {
  double fx = 0, fy = 0, moment = 0;   ///< moment about the origin
};

Resultant resultant(Simulation& simulation) {
  BodyProblem& problem = simulation.problem();
  problem.loads().evaluate(0.0, problem.state().external_force());
  Resultant r;
  for (const std::int32_t p : problem.body().internal()) {
    const Point x = problem.body().position(static_cast<std::size_t>(p));
    const double fx = problem.state().external_force().component(0)[p], fy = problem.state().external_force().component(1)[p];
    r.fx += fx;
    r.fy += fy;
    r.moment += x[0] * fy - x[1] * fx;
  }
  return r;
}

}  // namespace

TEST_CASE("traction: exact total, and the moment of a load on the face of a lattice") {
  const auto simulation = plate("x > 5.5", 0.0, "traction = [3, 1]\nface = \"+x\"");
  const Resultant r = resultant(*simulation);
  const double area = 5.0 * 2.0;
  CHECK(r.fx == doctest::Approx(3 * area).epsilon(1e-12));
  CHECK(r.fy == doctest::Approx(1 * area).epsilon(1e-12));
  CHECK(r.moment == doctest::Approx(area * (6.0 * 1 - 2.5 * 3)).epsilon(1e-12));
}

TEST_CASE("traction: exact total on a jittered cloud, with one layer or two in the set") {
  for (const char* set : {"x > 5.5", "x > 5.0", "x > 4.0"}) {
    const auto simulation = plate(set, 0.15, "traction = [3, 1]\nface = \"+x\"");
    const Resultant r = resultant(*simulation);
    INFO(set);
    CHECK(r.fx == doctest::Approx(30.0).epsilon(1e-12));
    CHECK(r.fy == doctest::Approx(10.0).epsilon(1e-12));
  }
}

TEST_CASE("traction: the forces on a face are the same whatever materials meet there") {
  const std::string regions =
      "[[region]]\nset = \"right\"\nmaterial = { type = \"neo_hookean\", shear_modulus = 3.0, bulk_modulus = 900.0 }\n"
      "[[region]]\nset = \"low\"\nmaterial = { type = \"saint_venant_kirchhoff\", youngs_modulus = 7.0, poisson_ratio = 0.1 }\n";
  for (const char* kinematics :
       {"type = \"conventional\"", "type = \"baqp\"", "type = \"projection\"", "type = \"bond_augmented\"", "type = \"sub_horizon\"",
        "type = \"bond_associated\"", "type = \"non_spherical\"", "type = \"selective\"\nbase = { type = \"baqp\" }", "type = \"ordinary\""})
    for (const double jitter : {0.0, 0.15})
      for (const char* beyond : {"", "[[symmetry]]\naxis = \"y\"\n"}) {
        INFO(kinematics, ", jitter ", jitter, " ", beyond);
        const std::string set = "x > 4.5\"\nlow = \"x > 3 && y < 2", load = "traction = [3, 1]\nface = \"+x\"";
        const auto one = plate(set, jitter, load, kinematics, beyond), several = plate(set, jitter, load, kinematics, beyond + regions);
        resultant(*one);
        resultant(*several);
        const FieldView a = one->problem().state().external_force(), b = several->problem().state().external_force();
        REQUIRE(a.size() == b.size());
        CHECK(std::equal(a.data, a.data + a.size(), b.data));
      }
}

TEST_CASE("force and body force: shared by volume") {
  CHECK(resultant(*plate("x > 5.5", 0.0, "force = [4, 0]")).fx == doctest::Approx(4.0).epsilon(1e-12));
  CHECK(resultant(*plate("x > 5.0", 0.2, "body_force = [0, 2]")).fy ==
        doctest::Approx(2.0 * 2 * 0.25 * 20 * 1.0).epsilon(0.2));   // jitter may move a few points across the line
}

TEST_CASE("traction: a set away from the face is refused") {
  CHECK_THROWS_AS(plate("x < 2", 0.0, "traction = [1, 0]\nface = \"+x\""), InputError);
}
