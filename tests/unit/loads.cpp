#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "tests/kit/registry.hpp"
#include "tests/kit/scene_text.hpp"

using namespace perikit;
using namespace perikit::test;

namespace {

std::unique_ptr<Simulation> plate(const std::string& set, double jitter, const std::string& load, const std::string& kinematics = "type = \"conventional\"",
                                  const std::string& further = "", double poisson_ratio = 0.25) {
  return simulation_of(SceneText{.body = "thickness = 2.0", .spacing = 0.5, .upper = {6, 5}, .lattice = fmt::format("jitter = {}", jitter), .sets = "right = \"" + set + "\"",
                                 .family = "horizon_ratio = 3.015", .kinematics = kinematics,
                                 .material = fmt::format("type = \"saint_venant_kirchhoff\"\nyoungs_modulus = 1.0\npoisson_ratio = {}", poisson_ratio),
                                 .further = fmt::format("[[load]]\nset = \"right\"\n{}\n{}", load, further)});
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

TEST_CASE("traction: exact total and moment with pair laws, on lattices and clouds, and on a face inside of a cloud") {
  for (const char* kinematics : {"type = \"bond_based\"", "type = \"ordinary\"", "type = \"ordinary\"\nsurface_correction = \"energy\""})
    for (const double jitter : {0.0, 0.15})
      for (const char* set : {"x > 5.5", "x > 4.0"}) {
        INFO(std::string(kinematics), ", jitter ", jitter, ", ", std::string(set));
        const auto simulation = plate(set, jitter, "traction = [3, 1]\nface = \"+x\"", kinematics);
        const Resultant r = resultant(*simulation);
        CHECK(r.fx == doctest::Approx(30.0).epsilon(1e-12));
        CHECK(r.fy == doctest::Approx(10.0).epsilon(1e-12));
        const Body& body = simulation->problem().body();
        double face = 6;   // of a cloud: half a cell beyond the outermost point
        if (jitter > 0) {
          face = 0;
          for (const std::int32_t p : body.internal()) face = std::max(face, body.position(static_cast<std::size_t>(p))[0] + 0.25);
        }
        double lever = 0;
        for (const std::int32_t p : body.internal()) lever += simulation->problem().state().external_force().component(1)[p] * body.position(static_cast<std::size_t>(p))[0];
        CHECK(lever == doctest::Approx(10 * face).epsilon(1e-11));
      }
  const auto inner = plate("x > 2 && x < 4", 0.15, "traction = [3, 1]\nface = \"+x\"", "type = \"ordinary\"");
  CHECK(resultant(*inner).fx == doctest::Approx(30.0).epsilon(0.1));   // as many points as layers of the set have near their outermost one
}

TEST_CASE("traction: the forces on a face are the same whatever materials meet there, and whatever acts beside them") {
  const std::string regions =
      "[[term]]\ntype = \"foundation\"\nset = \"all\"\nstiffness = 1000.0\n"
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

TEST_CASE("the overview has the loads of the end, which is the start where nothing runs") {
  CHECK(plate("x > 5.5", 0.0, "force = [\"4 + t\", 0]")->overview().find("together (4, 0) N at the end") != std::string::npos);
}

TEST_CASE("traction: a set away from the face is refused") {
  CHECK_THROWS_AS(plate("x < 2", 0.0, "traction = [1, 0]\nface = \"+x\""), InputError);
}

namespace {

/// Forces and their first moments less those of a traction: components x, y over 1, x, y.
using VirtualWork = std::array<std::array<double, 3>, 2>;

VirtualWork virtual_work(Simulation& simulation) {
  BodyProblem& problem = simulation.problem();
  problem.loads().evaluate(0.0, problem.state().external_force());
  VirtualWork work{};
  for (const std::int32_t p : problem.body().internal()) {
    const Point x = problem.body().position(static_cast<std::size_t>(p));
    for (std::size_t c = 0; c < 2; ++c) {
      const double f = problem.state().external_force().component(static_cast<int>(c))[p];
      work[c][0] += f;
      work[c][1] += f * x[0];
      work[c][2] += f * x[1];
    }
  }
  return work;
}

constexpr const char* with_faces[] = {
    "type = \"conventional\"", "type = \"baqp\"", "type = \"projection\"", "type = \"bond_augmented\"", "type = \"sub_horizon\"", "type = \"bond_associated\"",
    "type = \"non_spherical\"", "type = \"selective\"\nbase = { type = \"baqp\" }", "type = \"ordinary\"", "type = \"bond_based\""};

}  // namespace

TEST_CASE("traction that varies: the virtual work of every affine motion is exact") {
  // Integrals over the face x = 6, 0 < y < 5, thickness 2, of t = 3 + 2 y + y^2 and t = y - 1 times 1, x and y.
  const double I0 = 2 * (15.0 + 25.0 + 125.0 / 3), I1 = 2 * (3 * 12.5 + 2 * 125.0 / 3 + 625.0 / 4), J0 = 2 * (12.5 - 5.0), J1 = 2 * (125.0 / 3 - 12.5);
  for (const char* kinematics : with_faces) {
    INFO(kinematics);
    const auto simulation = plate("x > 5.5", 0.0, "traction = [\"3 + 2*y + y^2\", \"y - 1\"]\nface = \"+x\"", kinematics);
    // Some kinematics feel the opposite face, four horizons away.
    const VirtualWork work = virtual_work(*simulation), uniform = virtual_work(*plate("x > 5.5", 0.0, "traction = [1, 0]\nface = \"+x\"", kinematics));
    for (const auto& [found, wanted] :
         {std::pair(work[0][0], I0), {work[0][1], 6 * I0}, {work[0][2], I1}, {work[1][0], J0}, {work[1][1], 6 * J0}, {work[1][2], J1},
          {uniform[0][0], 10.0}, {uniform[0][1], 60.0}, {uniform[0][2], 25.0}})
      CHECK(found == doctest::Approx(wanted).epsilon(1e-12));
  }
}

TEST_CASE("traction that varies along the normal is that of the face") {
  const auto simulation = plate("x > 5.5", 0.0, "traction = [\"x^2\", 0]\nface = \"+x\"", "type = \"baqp\"");
  CHECK(virtual_work(*simulation)[0][0] == doctest::Approx(36 * 10.0).epsilon(1e-12));
}

TEST_CASE("traction: written as an expression of the position, a uniform one is shared out as a number is") {
  for (const double jitter : {0.0, 0.15}) {
    const auto number = plate("x > 5.5", jitter, "traction = [3, 0]\nface = \"+x\"", "type = \"baqp\""),
               expression = plate("x > 5.5", jitter, "traction = [\"3 + 0*y\", 0]\nface = \"+x\"", "type = \"baqp\"");
    resultant(*number);
    resultant(*expression);
    const FieldView a = number->problem().state().external_force(), b = expression->problem().state().external_force();
    for (std::size_t k = 0; k < a.size(); ++k) CHECK(b.data[k] == doctest::Approx(a.data[k]).epsilon(1e-12));
  }
}

TEST_CASE("pressure that varies: force and moment of a hydrostatic wall, and of a body under water") {
  for (const char* kinematics : with_faces)
    for (const char* follower : {"", "follower = true\n"}) {
      INFO(kinematics, " ", follower);
      const std::string pressure = std::string("pressure = \"7*(5 - y)\"\n") + follower;
      const auto wall = plate("x > 5.5", 0.0, pressure + "face = \"+x\"", kinematics);
      const Field H = wall->problem().body().make_field(5);
      BodyProblem& problem = wall->problem();
      problem.loads().evaluate(0.0, problem.state().external_force(), &H);
      double force = 0, moment = 0;
      for (const std::int32_t p : problem.body().internal()) {
        force += problem.state().external_force().component(0)[p];
        moment += problem.state().external_force().component(0)[p] * problem.body().position(static_cast<std::size_t>(p))[1];
      }
      CHECK(force == doctest::Approx(-7 * 12.5 * 2).epsilon(1e-12));
      CHECK(moment == doctest::Approx(-7 * 2 * (5 * 12.5 - 125.0 / 3)).epsilon(1e-12));
      if (*follower) continue;
      const VirtualWork work = virtual_work(*plate("x > -1", 0.0, pressure, kinematics));
      CHECK(work[1][0] == doctest::Approx(7 * 30.0 * 2).epsilon(1e-12));   // buoyancy
      CHECK(work[1][1] == doctest::Approx(7 * 30.0 * 2 * 3).epsilon(1e-12));
      CHECK(std::abs(work[0][0]) < 1e-10);
    }
}

TEST_CASE("pressure that varies, on a body without free faces across an axis") {
  for (const char* kinematics : with_faces) {
    INFO(kinematics);
    const auto simulation = plate("x > -1", 0.0, "pressure = \"7 + x\"", kinematics, "[[periodic]]\naxis = \"y\"\n");
    BodyProblem& problem = simulation->problem();
    problem.loads().evaluate(0.0, problem.state().external_force());
    double forces[2]{}, largest = 0;
    for (const std::int32_t p : problem.body().owned())
      for (int c = 0; c < 2; ++c) {
        forces[c] += problem.state().external_force().component(c)[p];
        if (c == 1) largest = std::max(largest, std::abs(problem.state().external_force().component(c)[p]));
      }
    CHECK(forces[0] == doctest::Approx(-(13 - 7) * 5.0 * 2).epsilon(1e-11));
    CHECK(largest <= 1e-11);
  }
}

TEST_CASE("tractions and pressures on a part of the surface of a lattice: force and first moments are those of its cell faces") {
  // Three spacings from an edge, where shares of kinematics are unlike cells; faces 0 < y < 5 at x = 6, 0 < x < 6 at y = 5, thickness 2.
    for (const char* kinematics : with_faces) {
    INFO(kinematics);
    const double area = 2 * 3.5, middle = 1.5 + 1.75, square = 2 * (125.0 - 27.0 / 8) / 3;   // of y^2
    const VirtualWork uniform = virtual_work(*plate("y > 1.4", 0.0, "traction = [3, 1]\nface = \"+x\"", kinematics));
    const VirtualWork linear = virtual_work(*plate("y > 1.4", 0.0, "traction = [\"2 + y\", 0]\nface = \"+x\"", kinematics));
    const VirtualWork pressure = virtual_work(*plate("y > 1.4", 0.0, "pressure = 3\nface = \"+x\"", kinematics));
    for (const auto& [found, wanted] :
         {std::pair(uniform[0][0], 3 * area), {uniform[0][1], 3 * area * 6}, {uniform[0][2], 3 * area * middle}, {uniform[1][0], area}, {uniform[1][1], area * 6}, {uniform[1][2], area * middle},
          {linear[0][0], area * (2 + middle)}, {linear[0][1], area * (2 + middle) * 6}, {linear[0][2], 2 * area * middle + square},
          {pressure[0][0], -3 * area}, {pressure[0][1], -3 * area * 6}, {pressure[0][2], -3 * area * middle}})
      CHECK(found == doctest::Approx(wanted).epsilon(1e-12));
    // A corner: 3 of the right side, 3 of the upper one (x > 3, y > 2), each with its own pressure.
    const VirtualWork corner = virtual_work(*plate("x > 3 && y > 2", 0.0, "pressure = \"1 + 2*y\"", kinematics));
    for (const auto& [found, wanted] : {std::pair(corner[0][0], -2 * (3 + 21.0)), {corner[0][1], -2 * (3 + 21.0) * 6}, {corner[0][2], -2 * (10.5 + 2 * 39.0)}, {corner[1][0], -2 * 3 * 11.0},
                                        {corner[1][1], -2 * 3 * 11.0 * 4.5}, {corner[1][2], -2 * 3 * 11.0 * 5}})
      CHECK(found == doctest::Approx(wanted).epsilon(1e-12));
  }
}

TEST_CASE("pressure that varies: force and moments on a cloud under water") {
  for (const char* kinematics : with_faces) {
    INFO(kinematics);
    // Bonds near the surface may have another stress than those inside: the moments of a uniform pressure are theirs.
    const bool pairs = std::string(kinematics).find("ordinary") != std::string::npos || std::string(kinematics).find("bond_based") != std::string::npos;
    const auto simulation = plate("x > -1", 0.2, "pressure = \"7*(5 - y) + 2*x\"", kinematics);
    const VirtualWork work = virtual_work(*simulation);
    // - int of d(p x_b)/dx_c over the body.
    VirtualWork wanted{};
    const Body& body = simulation->problem().body();
    for (const std::int32_t index : body.internal()) {
      const auto p = static_cast<std::size_t>(index);
      const Point x = body.position(p);
      const double slope[] = {2, -7}, pressure = 7 * (5 - x[1]) + 2 * x[0];
      for (std::size_t c = 0; c < 2; ++c) {
        wanted[c][0] -= body.volume(p) * slope[c];
        for (std::size_t b = 0; b < 2; ++b) wanted[c][1 + b] -= body.volume(p) * (slope[c] * x[b] + (b == c ? pressure : 0));
      }
    }
    for (std::size_t c = 0; c < 2; ++c)
      for (std::size_t b = 0; b < (pairs ? 1 : 3); ++b) CHECK(work[c][b] == doctest::Approx(wanted[c][b]).epsilon(1e-11));
  }
}

TEST_CASE("traction: a homogeneous stress in a thin body is in equilibrium with it on both faces") {
  // The plate is four horizons long: faces feel each other.
  for (const char* kinematics : with_faces)
    for (const double nu : {0.25, 0.0}) {
      const std::string name = kinematics;
      if (name.find("ordinary") != std::string::npos || name.find("bond_based") != std::string::npos) continue;   // no homogeneous stress near a face
      INFO(name, ", Poisson's ratio ", nu);
      const double strain = 1e-9, traction = 1 / (1 - nu * nu) * strain;
      const auto simulation = plate("x > -1", 0.0, fmt::format("traction = [{:.17g}, 0]\nface = \"+x\"", traction), kinematics,
                                    fmt::format("[[load]]\nset = \"all\"\ntraction = [{:.17g}, 0]\nface = \"-x\"\n", -traction), nu);
      BodyProblem& problem = simulation->problem();
      const Body& body = problem.body();
      Field u = body.make_field(2), force = body.make_field(2);
      for (const std::int32_t p : body.internal()) {
        const Point x = body.position(static_cast<std::size_t>(p));
        u.component(0)[p] = strain * x[0];
        u.component(1)[p] = -nu / (1 - nu) * strain * x[1];
      }
      REQUIRE(problem.evaluate_forces({u, 0}, force, nullptr).ok());
      problem.loads().evaluate(0.0, problem.state().external_force());
      // Under selective kinematics the mean stress has area vectors of its own, and how much of a traction is mean stress depends on the
      // law: with a Poisson's ratio of 0 it is a third, as loads take it. Along free sides what is left has no work in any affine motion.
      const bool selective = name.find("selective") != std::string::npos;
      VirtualWork work{};
      for (const std::int32_t p : body.internal())
        for (std::size_t c = 0; c < 2; ++c) {
          const double left = force.component(static_cast<int>(c))[p] + problem.state().external_force().component(static_cast<int>(c))[p];
          const Point x = body.position(static_cast<std::size_t>(p));
          for (std::size_t b = 0; b < 3; ++b) work[c][b] += left * (b == 0 ? 1.0 : x[b - 1]);
          if (!selective || (c == 0 && nu == 0)) CHECK(std::abs(left) < 1e-6 * traction);
        }
      for (std::size_t c = 0; c < 2; ++c)
        for (std::size_t b = 0; b < 3; ++b) CHECK(std::abs(work[c][b]) < 1e-6 * traction);
    }
}
