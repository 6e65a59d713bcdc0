/// Laws that read a variable from outside, here the law `their_warm` with its temperature: one value for the whole body, and a field.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "perikit/core/field_operations.hpp"
#include "run/simulation.hpp"
#include "tests/kit/derivative.hpp"
#include "tests/kit/matrices.hpp"
#include "tests/kit/scene_text.hpp"
#include "tests/kit/third_party.hpp"

using namespace perikit;
using perikit::test::with_third_parties;

namespace {

constexpr double youngs = 2.0, poisson = 0.25, expansion = 1e-3, reference = 300;
constexpr double lambda = youngs * poisson / ((1 + poisson) * (1 - 2 * poisson)), mu = youngs / (2 * (1 + poisson));
/// Stress by temperature of a body that may not grow [Pa/K].
constexpr double stress_by_temperature = -(3 * lambda + 2 * mu) * expansion;

const std::vector<std::string> kinematics{"type = \"conventional\"",  "type = \"conventional\"\norder = 2", "type = \"baqp\"",
                                          "type = \"projection\"",    "type = \"bond_augmented\"",          "type = \"sub_horizon\"",
                                          "type = \"bond_associated\"", "type = \"selective\"\nbase = { type = \"baqp\" }", "type = \"selective\"\nbase = { type = \"bond_associated\" }"};

struct Body9 {
  std::string kinematics;
  int dimension = 2;
  double jitter = 0;
  bool two_laws = false, skip = true;
};

std::unique_ptr<Simulation> plate(const Body9& of) {
  std::vector<double> upper = of.dimension == 3 ? std::vector<double>{6, 5, 5} : std::vector<double>{12, 9};
  upper.resize(static_cast<std::size_t>(of.dimension));
  const std::string elastic = fmt::format("youngs_modulus = {}, poisson_ratio = {} ", youngs, poisson);
  const std::string text = test::SceneText{.dimension = of.dimension, .upper = upper, .lattice = fmt::format("jitter = {}", of.jitter), .sets = fmt::format("half = \"x > {}\"", upper[0] / 2), .kinematics = of.kinematics,
                                           .material = fmt::format("type = \"their_warm\"\ndensity = 1\nyoungs_modulus = {}\npoisson_ratio = {}\nexpansion = {}", youngs, poisson, expansion),
                                           .further = (of.two_laws ? "[[region]]\nset = \"half\"\nmaterial = { type = \"hencky\", density = 1, " + elastic + "}\n" : std::string()) +
                                                      fmt::format("[run]\nskip = {}\n", of.skip)};
  return std::make_unique<Simulation>(parse_scene(text, "plate.toml", with_third_parties()), with_third_parties());
}

/// check(problem, what) on lattices and clouds, of one law and of two.
void for_every_body(const std::function<void(BodyProblem&)>& check) {
  for (const std::string& each : kinematics)
    for (int d = 1; d <= 3; ++d)
      for (const double jitter : {0.0, 0.15})
        for (const bool two_laws : {false, true}) {
          if (d == 1 && each.find("order") != std::string::npos) continue;
          INFO(fmt::format("{}, {}D, jitter {}, {}", each, d, jitter, two_laws ? "two laws" : "one law"));
          const auto simulation = plate({.kinematics = each, .dimension = d, .jitter = jitter, .two_laws = two_laws});
          check(simulation->problem());
        }
}

double middle(const BodyProblem& problem) { return problem.dimension() == 3 ? 3 : 6; }

bool warm(const BodyProblem& problem, std::size_t p) { return !problem.laws().record_of(p).material->external().empty(); }

/// 300 K and what grows with x, at every point.
Field temperatures(const BodyProblem& problem) {
  Field T = problem.body().make_field(1);
  for (const std::int32_t p : problem.body().internal()) {
    const Point x = problem.body().position(static_cast<std::size_t>(p));
    T.data()[p] = reference + 2 * x[0] - x[1];
  }
  return T;
}

Field displacements(const BodyProblem& problem, double size, double phase = 0) {
  Field u = problem.make_field();
  for (const std::int32_t p : problem.body().internal())
    for (int c = 0; c < problem.dimension(); ++c) u.component(c)[p] = size * std::sin(1.7 * p + 2.3 * c + phase);
  return u;
}

}  // namespace

TEST_CASE("external variables: one temperature for the whole body, without a displacement") {
  for_every_body([](BodyProblem& problem) {
    const Field rest = problem.make_field();
    for (const double temperature : {reference, 310.0}) {
      const std::array values{ExternalValue{.name = "wind", .value = 7}, ExternalValue{.name = "temperature", .value = temperature}};
      PointSamples samples{.asked = Sampling::P};
      REQUIRE(problem.terms().sample(Configuration(rest, 0).with_external(values), samples).ok());
      const double stress = stress_by_temperature * (temperature - reference);
      double worst = 0;
      for (const std::int32_t p : problem.body().internal())
        for (int c = 0; c < problem.dimension(); ++c) {
          const double found = samples.P.component(c * (problem.dimension() + 1))[p];
          // Laminates of two laws carry the same stress across their interface; away from it each its own.
          const double x = problem.body().position(static_cast<std::size_t>(p))[0];
          if (problem.laws().records().size() == 1 || std::abs(x - middle(problem)) > 4) worst = std::max(worst, std::abs(found - (warm(problem, static_cast<std::size_t>(p)) ? stress : 0.0)));
        }
      CHECK_MESSAGE(worst <= 1e-12 * std::abs(stress_by_temperature), "stresses off by ", worst);
    }
  });
}

TEST_CASE("external variables: a field of temperatures counts at points, and at bonds as the mean of both ends") {
  for_every_body([](BodyProblem& problem) {
    const Field rest = problem.make_field(), T = temperatures(problem);
    const std::array values{ExternalValue{.name = "temperature", .field = T}};
    PointSamples samples{.asked = Sampling::P};
    REQUIRE(problem.terms().sample(Configuration(rest, 0).with_external(values), samples).ok());
    // Where families are whole on a lattice, the mean of an affine field over a family is its value at the point.
    const bool lattice = problem.body().lattice() != nullptr;
    double worst = 0, most = 0;
    int inside = 0;
    const auto deep = [&](const Point& x) {
      const std::array<double, 3> upper = problem.dimension() == 3 ? std::array<double, 3>{6, 5, 5} : std::array<double, 3>{12, 9, 0};
      for (std::size_t c = 0; c < static_cast<std::size_t>(problem.dimension()); ++c)
        if (x[c] < 2.1 || x[c] > upper[c] - 2.1) return false;
      return true;
    };
    for (const std::int32_t p : problem.body().internal()) {
      const Point x = problem.body().position(static_cast<std::size_t>(p));
      if (problem.laws().records().size() > 1 && std::abs(x[0] - middle(problem)) < 4) continue;
      const double expected = warm(problem, static_cast<std::size_t>(p)) ? stress_by_temperature * (T.data()[p] - reference) : 0.0, found = samples.P.component(0)[p];
      most = std::max(most, std::abs(found - expected));
      if (!lattice || !deep(x)) continue;
      ++inside;
      worst = std::max(worst, std::abs(found - expected));
    }
    CHECK_MESSAGE(worst <= 1e-11 * std::abs(stress_by_temperature), "stresses off by ", worst);
    CHECK_MESSAGE(most <= 8 * std::abs(stress_by_temperature), "a point hears temperatures of points beyond its family: ", most);
    if (lattice && problem.laws().records().size() == 1) CHECK(inside > 0);
  });
}

TEST_CASE("external variables: force = -dE/du and tangent = dF/du at a field of temperatures, assembled too, and the same on any number of threads") {
  for_every_body([](BodyProblem& problem) {
    const Field T = temperatures(problem), u = displacements(problem, 0.01), w = displacements(problem, 1, 0.5), v = displacements(problem, 1, 1.1);
    const std::array values{ExternalValue{.name = "temperature", .field = T}};
    const auto at = [&](ConstFieldView x) { return Configuration(x, 0).with_external(values); };
    const auto evaluate = [&](double s, FieldView force) {
      Field moved = problem.make_field();
      combine(1, u, s, w, moved);
      double energy = 0;
      REQUIRE(problem.evaluate_forces(at(moved), force, &energy).ok());
      return energy;
    };
    Field f = problem.make_field(), other = problem.make_field(), Kw = problem.make_field();
    const double energy = evaluate(0, f), slope = test::slope_of([&](double s) { return evaluate(s, other); }, 2e-4);
    CHECK(std::abs(slope + perikit::dot(f, w)) <= 1e-8 * std::abs(slope));
    REQUIRE(problem.tangent_action(at(u), w, Kw).ok());
    const double curvature = test::slope_of(
        [&](double s) {
          evaluate(s, other);
          return -perikit::dot(other, v);
        },
        2e-4);
    CHECK(std::abs(curvature - perikit::dot(Kw, v)) <= 1e-7 * std::abs(curvature));
    BlockMatrix K;
    REQUIRE(problem.assemble_tangent(at(u), K).ok());
    CHECK(test::product_error(problem, K, w, Kw) <= 1e-11);
    // The temperature is part of the tangent: another one without it.
    Field cold = problem.make_field();
    REQUIRE(problem.tangent_action({u, 0}, w, cold).ok());
    combine(1, cold, -1, Kw, cold);
    CHECK(largest_magnitude(cold) > 1e-3 * expansion * largest_magnitude(Kw));
    const int threads = thread_count();
    set_thread_count(3);
    double again = 0;
    REQUIRE(problem.evaluate_forces(at(u), other, &again).ok());
    set_thread_count(threads);
    CHECK(again == energy);
    for (const std::int32_t p : problem.body().internal())
      for (int c = 0; c < problem.dimension(); ++c) CHECK(other.component(c)[p] == f.component(c)[p]);
  });
}

TEST_CASE("external variables: a body at rest hears of its temperature, and without one it has the reference temperature") {
  for (const std::string& each : kinematics) {
    INFO(each);
    const auto skipping = plate({.kinematics = each}), all = plate({.kinematics = each, .skip = false});
    Field force = skipping->problem().make_field(), expected = force;
    const Field rest = force;
    const std::array values{ExternalValue{.name = "temperature", .value = 320}};
    for (const bool hot : {false, true, false}) {
      const Configuration at = hot ? Configuration(rest, 0).with_external(values) : Configuration(rest, 0);
      REQUIRE(skipping->problem().evaluate_forces(at, force, nullptr).ok());
      REQUIRE(all->problem().evaluate_forces(at, expected, nullptr).ok());
      CHECK((largest_magnitude(force) > 0) == hot);
      combine(1, force, -1, expected, force);
      CHECK(largest_magnitude(force) == 0);
    }
  }
}
