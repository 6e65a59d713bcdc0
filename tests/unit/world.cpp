/// Two bodies in the same fields, and a spring from a point of one to a point of the other.

#include "problem/world.hpp"

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <stdexcept>

#include "core/threads/work_steps.hpp"
#include "perikit/core/field_operations.hpp"
#include "perikit/problem/motion.hpp"
#include "scene/scene.hpp"
#include "setup/problem.hpp"
#include "tests/kit/derivative.hpp"
#include "tests/kit/registry.hpp"
#include "tests/kit/scene_text.hpp"

using namespace perikit;
using namespace perikit::test;

namespace {

constexpr double stiffness = 0.7;   // [N/m]

/// E = k/2 (|y_q - y_p| - |x_q - x_p|)^2 in the plane.
class Spring final : public Term {
 public:
  Spring(const Points& points, std::size_t p, std::size_t q) : p_(p), q_(q), xi_{points.position(q)[0] - points.position(p)[0], points.position(q)[1] - points.position(p)[1]} {}

  std::int64_t forces(const Configuration& at, const Region&, const ForceSum& sum) override {
    const auto [direction, length, stretch] = bond(at.u());
    for (int c = 0; c < 2; ++c) {
      sum.force.component(c)[p_] += stiffness * stretch * direction[static_cast<std::size_t>(c)];
      sum.force.component(c)[q_] -= stiffness * stretch * direction[static_cast<std::size_t>(c)];
    }
    if (sum.wants_stored()) sum.energies[p_ / padding].stored += stiffness * stretch * stretch / 2;
    return -1;
  }
  std::int64_t tangent(const Configuration& at, ConstFieldView w, const Region&, FieldView Kw) override {
    const auto [direction, length, stretch] = bond(at.u());
    for (int c = 0; c < 2; ++c)
      for (int e = 0; e < 2; ++e) {
        const double along = direction[static_cast<std::size_t>(c)] * direction[static_cast<std::size_t>(e)];
        const double entry = stiffness * (along + stretch / length * ((c == e) - along)), change = w.component(e)[q_] - w.component(e)[p_];
        Kw.component(c)[q_] += entry * change;
        Kw.component(c)[p_] -= entry * change;
      }
    return -1;
  }
  void report(ModelReport& report) const override { report.notes.emplace_back("spring", "between two bodies"); }

 private:
  struct Bond {
    std::array<double, 2> direction;
    double length, stretch;
  };
  Bond bond(ConstFieldView u) const {
    std::array<double, 2> y{};
    for (int c = 0; c < 2; ++c) y[static_cast<std::size_t>(c)] = xi_[static_cast<std::size_t>(c)] + u.component(c)[q_] - u.component(c)[p_];
    const double length = std::hypot(y[0], y[1]);
    return {{y[0] / length, y[1] / length}, length, length - std::hypot(xi_[0], xi_[1])};
  }

  std::size_t p_, q_;
  std::array<double, 2> xi_;
};

/// A plate of 9 x 7 points on a lattice, and a cloud of 7 x 6 points to the right of it.
std::unique_ptr<BodyProblem> body_of(const std::string& kinematics, bool cloud, const std::string& further = "") {
  SceneText text{.upper = {9, 7}, .family = "horizon_ratio = 2.515", .kinematics = kinematics, .material = "type = \"neo_hookean\"\nyoungs_modulus = 2.0\npoisson_ratio = 0.25\ndensity = 1",
                 .further = further};
  if (cloud) {
    text.lower = {11, 0};
    text.upper = {18, 6};
    text.lattice = "jitter = 0.2";
  }
  const Scene scene = parse_scene(text, "plate.toml", all_parts());
  WorkSteps steps;
  return build_problem(scene, all_parts(), all_parts().integrator(*scene.integrator)->traits(), steps);
}

struct TwoBodies {
  explicit TwoBodies(const std::string& kinematics)
      : plate(body_of(kinematics, false)), cloud(body_of(kinematics, true)), points({&plate->body(), &cloud->body()}) {}

  World world(bool spring) {
    std::vector<std::unique_ptr<Term>> between;
    if (spring) between.push_back(std::make_unique<Spring>(points, static_cast<std::size_t>(points.owned()[5]), static_cast<std::size_t>(points.owned()[80])));
    return World({{"plate", &plate->terms()}, {"cloud", &cloud->terms()}}, std::move(between));
  }
  Field deformed(double scale) const {
    Field u = points.make_field(2);
    for (const std::int32_t p : points.owned()) {
      const Point x = points.position(static_cast<std::size_t>(p));
      u.component(0)[p] = scale * std::sin(0.4 * x[0] + 0.7 * x[1]);
      u.component(1)[p] = scale * std::cos(0.9 * x[0] - 0.3 * x[1]);
    }
    return u;
  }

  std::unique_ptr<BodyProblem> plate, cloud;
  Points points;
};

const std::array kinematics_of_all_kinds{"type = \"baqp\"", "type = \"conventional\"\nstabilization = \"silling\"", "type = \"bond_based\"", "type = \"ordinary\"", "type = \"sub_horizon\""};

}  // namespace

TEST_CASE("world: points of two bodies follow each other") {
  const TwoBodies two("baqp");
  const Points& points = two.points;
  const Body &plate = two.plate->body(), &cloud = two.cloud->body();
  CHECK(points.stride() == plate.stride() + cloud.stride());
  CHECK(points.size() == 63 + 42);
  CHECK(points.size_on_all_ranks() == 63 + 42);
  CHECK(!points.on_lattices());
  CHECK(!points.distributed());
  for (std::size_t n = 0; n < points.owned().size(); ++n) {
    const auto p = static_cast<std::size_t>(points.owned()[n]);
    const Body& body = n < 63 ? plate : cloud;
    const auto own = static_cast<std::size_t>(body.owned()[n < 63 ? n : n - 63]);
    CHECK(points.slice_of(p).body == &body);
    CHECK(points.position(p) == body.position(own));
    CHECK(points.volume(p) == body.volume(own));
    CHECK(points.number(p) == static_cast<std::int64_t>(n));
    CHECK(points.owns(p));
    CHECK(!points.image(p));
  }
  CHECK(points.numbers(points.owned()).back() == 104);
}

TEST_CASE("world: without terms between them, each body has the forces and tangents that it has alone, bit for bit") {
  for (const std::string kinematics : kinematics_of_all_kinds) {
    INFO(kinematics);
    TwoBodies two(kinematics);
    World world = two.world(false);
    const Field u = two.deformed(0.12), w = two.deformed(1);
    Field f = two.points.make_field(2), Kw = f;
    f.fill(3);   // overwritten
    Kw.fill(3);
    double energy = 0, sum = 0;
    REQUIRE(world.forces({u, 0}, f, &energy).ok());
    REQUIRE(world.tangent({u, 0}, w, Kw).ok());
    std::size_t first = 0;
    for (BodyProblem* const alone : {two.plate.get(), two.cloud.get()}) {
      Field own_u = alone->make_field(), own_w = own_u, own_f = own_u, own_Kw = own_u;
      for (int c = 0; c < 2; ++c)
        for (std::size_t p = 0; p < own_u.stride(); ++p) {
          own_u.component(c)[p] = u.component(c)[first + p];
          own_w.component(c)[p] = w.component(c)[first + p];
        }
      double own_energy = 0;
      REQUIRE(alone->evaluate_forces({own_u, 0}, own_f, &own_energy).ok());
      REQUIRE(alone->tangent_action({own_u, 0}, own_w, own_Kw).ok());
      int others = 0;
      for (int c = 0; c < 2; ++c)
        for (std::size_t p = 0; p < own_u.stride(); ++p)
          others += f.component(c)[first + p] != own_f.component(c)[p] || Kw.component(c)[first + p] != own_Kw.component(c)[p];
      CHECK(others == 0);
      sum += own_energy;
      first += own_u.stride();
    }
    CHECK(energy == sum);
  }
}

TEST_CASE("world: with a spring from body to body, force = -dE/du, tangent = dF/du, and momentum is zero") {
  for (const std::string kinematics : kinematics_of_all_kinds) {
    INFO(kinematics);
    TwoBodies two(kinematics);
    World world = two.world(true), apart = two.world(false);
    const Field u = two.deformed(0.12);
    Field w = two.deformed(1), f = two.points.make_field(2), without = f, other = f, Kw = f;
    const double h = 1e-4;
    const auto at = [&](double s, FieldView force) {
      Field moved = two.points.make_field(2);
      combine(1, u, s, w, moved);
      double energy = 0;
      REQUIRE(world.forces({moved, 0}, force, &energy).ok());
      return energy;
    };
    const double slope = slope_of([&](double s) { return at(s, other); }, h);
    at(0, f);
    CHECK(std::abs(slope + dot(f, w)) <= 1e-8 * std::abs(slope));
    REQUIRE(world.tangent({u, 0}, w, Kw).ok());
    const auto along = [&](double s) {
      at(s, other);
      return -dot(other, w);
    };
    const double curvature = slope_of(along, h);
    CHECK(std::abs(curvature - dot(Kw, w)) <= 1e-7 * std::abs(curvature));
    // The spring acts, and on nothing but its ends.
    REQUIRE(apart.forces({u, 0}, without, nullptr).ok());
    int others = 0;
    for (std::size_t k = 0; k < f.size(); ++k) others += f.data()[k] != without.data()[k];
    CHECK(others == 4);
    double size = 0;
    for (const std::int32_t p : two.points.live()) size += std::abs(f.component(0)[p]) + std::abs(f.component(1)[p]);
    for (const Field& motion : rigid_motions(two.points, u)) CHECK(std::abs(dot(motion, f)) <= 1e-13 * size);
  }
}

TEST_CASE("world: what is inadmissible is named by its body, and by its number in all bodies") {
  TwoBodies two("baqp");
  World world = two.world(true);
  Field u = two.points.make_field(2), f = u;
  const std::span<const std::int32_t> of_cloud = two.points.owned().subspan(63);
  for (const std::int32_t p : of_cloud) u.component(0)[p] = -3 * two.points.position(static_cast<std::size_t>(p))[0];   // turned inside out
  const EvaluationStatus status = world.forces({u, 0}, f, nullptr);
  CHECK(!status.ok());
  CHECK(status.point >= 63);
  CHECK(status.description.find("of the body \"cloud\"") != std::string::npos);
}

TEST_CASE("world: what it cannot evaluate yet is refused") {
  class Driven final : public Term, public DrivenTerm {
   public:
    std::int64_t forces(const Configuration&, const Region&, const ForceSum&) override { return -1; }
    std::int64_t tangent(const Configuration&, ConstFieldView, const Region&, FieldView) override { return -1; }
    void report(ModelReport&) const override {}
    DrivenTerm* driven() noexcept override { return this; }
    bool driven(Drive) const noexcept override { return true; }
    std::int64_t driven_forces(const Configuration&, Drive, const ForceSum&) override { return -1; }
    bool conservative() const noexcept override { return true; }
    bool needs_velocity() const noexcept override { return false; }
  };
  TwoBodies two("bond_based");
  std::vector<std::unique_ptr<Term>> between;
  between.push_back(std::make_unique<Driven>());
  CHECK_THROWS_AS(World({{"plate", &two.plate->terms()}, {"cloud", &two.cloud->terms()}}, std::move(between)), std::invalid_argument);
  const std::unique_ptr<BodyProblem> brittle = body_of("bond_based", false, "[damage]\ntype = \"critical_stretch\"\nstretch = 0.05");
  CHECK_THROWS_AS(World({{"brittle", &brittle->terms(), brittle->fracture()}, {"cloud", &two.cloud->terms()}}), std::invalid_argument);
}
