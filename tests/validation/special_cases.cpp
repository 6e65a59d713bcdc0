/// Formulations that must coincide (Hu et al., A unified framework of bond-associated correspondence models), through the engine.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <utility>
#include <vector>

#include "tests/contract/integrator_fixture.hpp"
#include "tests/kit/derivative.hpp"
#include "tests/kit/matrices.hpp"
#include "tests/kit/observers.hpp"
#include "tests/validation/scenes.hpp"

using namespace perikit;
using namespace perikit::validation;
using contract::BodyOptions;

namespace {

/// Energies and forces of two kinematics in the same finite, noisy deformation.
void check_same(const BodyOptions& options, const std::string& a, const std::string& b) {
  INFO(a, " against ", b, ", ", options.dimension, "D ", options.influence, options.crack ? " cracked" : "");
  const auto one = build(contract::scene_text(options, a)), two = build(contract::scene_text(options, b));
  for (const auto& simulation : {one.get(), two.get()}) {
    contract::deform(simulation->problem().body(), simulation->problem().state().displacement(), 61, 0.02);
  }
  double energy = 0, expected = 0;
  const Field force = contract::force_of(one->problem(), one->problem().state().displacement(), &energy);
  const Field other = contract::force_of(two->problem(), two->problem().state().displacement(), &expected);
  const Body& body = one->problem().body();
  const double worst = contract::difference(body, force, other);
  CHECK_MESSAGE(std::abs(energy - expected) <= 1e-12 * expected, energy, " against ", expected);
  CHECK_MESSAGE(worst <= 1e-11 * contract::largest(body, other), "forces differ by ", worst, " of ", contract::largest(body, other));
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

TEST_CASE("sub_horizon with one part is the conventional model") {
  for (int d = 1; d <= 3; ++d)
    for (const char* influence : {"constant", "gaussian"}) {
      const BodyOptions cloud{.dimension = d, .cloud = true, .influence = influence};
      check_same(cloud, "type = \"sub_horizon\"\nparts = 1", "type = \"conventional\"");
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
    const Field force = contract::force_of(one->problem(), one->problem().state().displacement());
    const Field expected = contract::force_of(two->problem(), two->problem().state().displacement());
    PointSamples a, b;
    REQUIRE(one->problem().terms().sample({one->problem().state().displacement(), 0}, a).ok());
    REQUIRE(two->problem().terms().sample({two->problem().state().displacement(), 0}, b).ok());
    const std::int32_t p = two->problem().body().set("inside").front();
    const double density = b.strain_energy_density.data()[p];
    CHECK(std::abs(a.strain_energy_density.data()[p] - density) <= 1e-12 * density);
    double worst = 0, scale = 0;
    for (int c = 0; c < 3; ++c) {
      worst = std::max(worst, std::abs(force.component(c)[p] - expected.component(c)[p]));
      scale = std::max(scale, std::abs(expected.component(c)[p]));
    }
    CHECK(scale > 0);
    CHECK_MESSAGE(worst <= 1e-11 * scale, "forces differ by ", worst, " of ", scale);
  }
}

TEST_CASE("selective leaves evaluation points alone whose owner has no gradient of its own") {
  // A block with a spur one point wide: the families of its last four points lie on a line.
  const auto spur = [](bool cloud, const std::string& kinematics) {
    std::string text = contract::scene_text({.dimension = 2, .cloud = cloud, .cells = 16}, kinematics);
    const std::string section = "[body.lattice]\n", jitter = "jitter = 0.25";
    text.insert(text.find(section) + section.size(), "inside = \"x < 8 || (y > 4 && y < 5)\"\n");
    if (cloud) text.replace(text.find(jitter), jitter.size(), "jitter = 1e-13");
    auto simulation = build(text);
    contract::deform(simulation->problem().body(), simulation->problem().state().displacement(), 61, 0.02);
    return simulation;
  };
  for (const bool cloud : {false, true})
    for (const char* base : {"baqp", "projection"}) {
      INFO(base, cloud ? " cloud" : " lattice");
      const auto plain = spur(cloud, fmt::format("type = \"{}\"", base)), mapped = spur(cloud, fmt::format("type = \"selective\"\nbase = \"{}\"", base));
      BodyProblem& problem = mapped->problem();
      const Body& body = problem.body();
      REQUIRE(problem.report().singular_families == 4);
      PointSamples a, b;
      REQUIRE(plain->problem().terms().sample({plain->problem().state().displacement(), 0}, a).ok());
      REQUIRE(problem.terms().sample({problem.state().displacement(), 0}, b).ok());
      const Field condition = problem.terms().shape_tensor_condition();
      int same = 0, different = 0;
      for (const std::int32_t p : body.internal()) {
        const double before = a.strain_energy_density.data()[p], change = std::abs(b.strain_energy_density.data()[p] - before);
        if (!std::isfinite(condition.data()[p])) CHECK_MESSAGE(change <= 1e-13 * before, "point on the spur: changed by ", change / before);
        (change <= 1e-13 * before ? same : different) += 1;
      }
      CHECK(same == 4);
      CHECK(different == static_cast<int>(body.points()) - 4);
      // Still the derivative of the energy.
      Field w = problem.body().make_field(2), f = problem.body().make_field(2), scratch = problem.body().make_field(2);
      contract::Noise random(62);
      contract::set_field(body, w, [&](const Point&) { return Point{random(), random(), 0}; });
      REQUIRE(problem.evaluate_forces({problem.state().displacement(), 0}, f, nullptr).ok());
      const auto energy = [&](double h) {
        Field u = problem.body().make_field(2);
        for (std::size_t k = 0; k < u.size(); ++k) u.data()[k] = problem.state().displacement().data[k] + h * w.data()[k];
        double value = 0;
        REQUIRE(problem.evaluate_forces({u, 0}, scratch, &value).ok());
        return value;
      };
      const double slope = test::slope_of(energy, 2e-3);
      CHECK(std::abs(slope + contract::dot(body, f, w)) <= 1e-7 * contract::largest(body, f) * static_cast<double>(body.points()));
      // The assembled tangent knows these owners too.
      Field Kw = problem.body().make_field(2);
      BlockMatrix K;
      REQUIRE(problem.tangent_action({problem.state().displacement(), 0}, w, Kw).ok());
      REQUIRE(problem.assemble_tangent({problem.state().displacement(), 0}, K).ok());
      CHECK(test::product_error(problem, K, w, Kw) <= 1e-12);
    }
}

TEST_CASE("a report counts the evaluation points of a force evaluation: points, bonds, or parts of families") {
  for (const bool cloud : {false, true}) {
    INFO(std::string(cloud ? "cloud" : "lattice"));
    std::size_t points = 0;
    const auto count = [&](const std::string& kinematics) {
      const auto simulation = build(contract::scene_text({.dimension = 2, .cloud = cloud, .cells = 8}, kinematics));
      points = simulation->problem().body().points();
      return simulation->problem().report().evaluation_points;
    };
    const std::size_t bonds = 2 * count("type = \"bond_based\"");
    CHECK(count("type = \"conventional\"") == points);
    CHECK(bonds > 4 * points);
    CHECK(count("type = \"baqp\"") == bonds / 2);   // both ends at once
    CHECK(count("type = \"bond_associated\"") == bonds);
    CHECK(count("type = \"sub_horizon\"") == 4 * points);
  }
}

TEST_CASE("a consistent cloud says between which bounds its weights lie, positive ones about 1") {
  const auto simulation = build(contract::scene_text({.dimension = 2, .cloud = true, .consistent = true, .cells = 8}, "type = \"baqp\""));
  double low = 0, high = 0;
  for (const auto& [label, text] : simulation->problem().report().notes)
    if (const std::size_t at = text.find("w/W "); at != std::string::npos) REQUIRE(std::sscanf(text.c_str() + at, "w/W %lf to %lf", &low, &high) == 2);
  CHECK(low > 0);
  CHECK(low < 1);
  CHECK(high > 1);
}

TEST_CASE("one evaluation is a sample of step 0 at time 0") {
  class Asked final : public test::Silent {
   public:
    bool wants_sample(std::int64_t step, double time) override {
      asked.emplace_back(step, time);
      return true;
    }
    void step_done(const StepReport& report) override { CHECK(report.time == 0); }
    std::vector<std::pair<std::int64_t, double>> asked;
  };
  const auto simulation = build(contract::scene_text({.dimension = 2, .cells = 6}, "type = \"baqp\""));
  Asked observer;
  simulation->run(observer);
  REQUIRE(observer.asked.size() == 1);
  CHECK(observer.asked[0] == std::pair<std::int64_t, double>{0, 0.0});
}

TEST_CASE("bonds that fail give what they owe to every point, the first one too: momentum is kept") {
  for (const bool cloud : {false, true}) {
    INFO(std::string(cloud ? "cloud" : "lattice"));
    contract::BodyOptions body{.dimension = 1, .cloud = cloud, .cells = 2, .integrator = "type = \"verlet\"\nend_time = 0.5"};
    body.material = "type = \"saint_venant_kirchhoff\"\ndensity = 1.0\nyoungs_modulus = 2000.0\npoisson_ratio = 0.3";
    body.conditions = "[initial]\nvelocity = [\"3*(x - 1)\"]\n[damage]\ntype = \"critical_stretch\"\nstretch = 0.02\n";
    const auto simulation = build(contract::scene_text(body, "type = \"baqp\""));
    BodyProblem& problem = simulation->problem();
    const auto momentum = [&] {
      double sum = 0, size = 0;
      for (const std::int32_t p : problem.body().internal()) {
        const double mv = problem.masses().by_point()[static_cast<std::size_t>(p)] * problem.state().velocity().component(0)[p];
        sum += mv;
        size += std::abs(mv);
      }
      return std::pair(sum, size);
    };
    const auto [before, before_size] = momentum();
    contract::run(*simulation);
    const auto [after, size] = momentum();
    CHECK(problem.fracture()->checks().failed > 0);
    CHECK(size > 0);
    CHECK(std::abs(after - before) <= 1e-12 * size);
  }
}

TEST_CASE("bonds that fail while their points are inside out: nothing is taken of them that is not a number, and the summary says so") {
  for (const bool cloud : {false, true}) {
    INFO(std::string(cloud ? "cloud" : "lattice"));
    contract::BodyOptions body{.dimension = 2, .cloud = cloud, .cells = 12};
    body.material = "type = \"saint_venant_kirchhoff\"\ndensity = 1.0\nyoungs_modulus = 2.0\npoisson_ratio = 0.3";
    body.conditions = "[damage]\ntype = \"critical_stretch\"\nstretch = 0.5\n";
    const auto simulation = build(contract::scene_text(body, "type = \"baqp\""));
    BodyProblem& problem = simulation->problem();
    REQUIRE(problem.fracture_summary().find("inside out") == std::string::npos);
    // One half is mirrored, which leaves its bonds their lengths, and goes away from the other.
    const FieldView u = problem.state().displacement();
    for (const std::int32_t p : problem.body().internal()) {
      const double x = problem.body().position(static_cast<std::size_t>(p))[0];
      if (x > 6) u.component(0)[p] = 12 - 2 * x, u.component(1)[p] = 40;
    }
    CHECK(problem.advance(0));
    CHECK(problem.fracture()->checks().failed > 0);
    CHECK(problem.state().energies.dissipated == 0);
    CHECK(problem.fracture_summary().find("warning       1 times points were turned inside out where bonds failed") != std::string::npos);
  }
}
