/// A term that no other file knows: springs that hold every point where it was, stiffer the farther it has gone. It is part of
/// energies, forces, tangent actions, assembled tangents, and of equilibria, with bonds that fail, too.

#include <doctest/doctest.h>

#include <cmath>

#include "core/threads/work_steps.hpp"
#include "perikit/core/block_matrix.hpp"
#include "perikit/core/field_operations.hpp"
#include "scene/scene.hpp"
#include "setup/problem.hpp"
#include "terms/term.hpp"
#include "tests/kit/derivative.hpp"
#include "tests/kit/matrices.hpp"
#include "tests/kit/observers.hpp"
#include "tests/kit/registry.hpp"
#include "tests/kit/scene_text.hpp"

using namespace perikit;
using namespace perikit::test;

namespace {

constexpr double stiffness = 0.3, length = 0.5;  // k [N/m^4], and how far a spring goes until it is twice as stiff

/// E = sum_i V_i k (|u_i|^2 / 2 + |u_i|^4 / (4 l^2)).
class Foundation final : public Term {
 public:
  explicit Foundation(const TermParts& parts) : body_(parts.families->body()) {}

  std::int64_t forces(const Configuration& at, const Region&, const ForceSum& sum) override {
    const ConstFieldView u = at.u();
    for (const std::int32_t p : body_.internal()) {
      const double k = stiffness * body_.volume(static_cast<std::size_t>(p)), square = square_of(u, p);
      for (int c = 0; c < u.components; ++c) sum.force.component(c)[p] -= k * (1 + square / (length * length)) * u.component(c)[p];
      if (sum.wants_stored()) sum.energies[static_cast<std::size_t>(p) / padding].stored += k * (square / 2 + square * square / (4 * length * length));
    }
    return -1;
  }
  std::int64_t tangent(const Configuration& at, ConstFieldView w, const Region&, FieldView Kw) override {
    const ConstFieldView u = at.u();
    for (const std::int32_t p : body_.internal())
      for (int c = 0; c < u.components; ++c)
        for (int e = 0; e < u.components; ++e) Kw.component(c)[p] += body_.volume(static_cast<std::size_t>(p)) * entry(u, p, c, e) * w.component(e)[p];
    return -1;
  }
  void report(ModelReport& report) const override { report.notes.emplace_back("foundation", "springs at all points"); }

 private:
  /// d2E/du_c du_e of a unit of volume.
  static double entry(ConstFieldView u, std::int32_t p, int c, int e) {
    const double along = 2 * u.component(c)[p] * u.component(e)[p] / (length * length);
    return stiffness * ((c == e ? 1 + square_of(u, p) / (length * length) : 0.0) + along);
  }
  static double square_of(ConstFieldView u, std::int32_t p) {
    double square = 0;
    for (int c = 0; c < u.components; ++c) square += u.component(c)[p] * u.component(c)[p];
    return square;
  }

  const Body& body_;
};

/// A plate of 9 x 7 points of E = 2, nu = 0.25.
std::string plate(const std::string& kinematics, const std::string& further, const std::string& integrator = "evaluate") {
  return SceneText{.upper = {9, 7}, .family = "horizon_ratio = 2.515", .kinematics = kinematics,
                   .material = "type = \"neo_hookean\"\nyoungs_modulus = 2.0\npoisson_ratio = 0.25\ndensity = 1", .further = further, .integrator = integrator};
}

std::unique_ptr<BodyProblem> with_foundation(const std::string& scene) {
  WorkSteps steps;
  const Scene read = parse_scene(scene, "plate.toml", all_parts());
  return build_problem(read, all_parts(), all_parts().integrator(*read.integrator)->traits(), steps,
                       {[](const TermParts& of) { return std::make_unique<Foundation>(of); }});
}

void fill(const BodyProblem& problem, FieldView u, double scale) {
  for (const std::int32_t p : problem.body().internal()) {
    const Point x = problem.body().position(static_cast<std::size_t>(p));
    u.component(0)[p] = scale * std::sin(0.4 * x[0] + 0.7 * x[1]);
    u.component(1)[p] = scale * std::cos(0.9 * x[0] - 0.3 * x[1]);
  }
}

double product(const BodyProblem& problem, ConstFieldView a, ConstFieldView b) {
  double sum = 0;
  for (int c = 0; c < a.components; ++c)
    for (const std::int32_t p : problem.body().internal()) sum += a.component(c)[p] * b.component(c)[p];
  return sum;
}

}  // namespace

TEST_CASE("a further term: force = -dE/du, tangent = dF/du, the same assembled, beside every kind of formulation") {
  for (const std::string kinematics : {"type = \"baqp\"", "type = \"conventional\"\nstabilization = \"silling\"", "type = \"bond_based\"", "type = \"sub_horizon\""}) {
    INFO(kinematics);
    const std::unique_ptr<BodyProblem> problem = with_foundation(plate(kinematics, ""));
    Field u = problem->make_field(), w = u, f = u, other = u, Kw = u;
    fill(*problem, u, 0.12);
    for (const std::int32_t p : problem->body().internal())
      for (int c = 0; c < 2; ++c) w.component(c)[p] = std::sin(1.7 * p + c);
    const double h = 1e-4;
    const auto at = [&](double s, FieldView force) {
      Field moved = problem->make_field();
      combine(1, u, s, w, moved);
      double energy = 0;
      REQUIRE(problem->evaluate_forces({moved, 0}, force, &energy).ok());
      return energy;
    };
    const double slope = slope_of([&](double s) { return at(s, other); }, h);
    at(0, f);
    CHECK(std::abs(slope + product(*problem, f, w)) <= 1e-8 * std::abs(slope));
    REQUIRE(problem->tangent_action({u, 0}, w, Kw).ok());
    const auto along = [&](double s) {
      at(s, other);
      return -product(*problem, other, w);
    };
    const double curvature = slope_of(along, h);
    CHECK(std::abs(curvature - product(*problem, Kw, w)) <= 1e-7 * std::abs(curvature));
    BlockMatrix K;
    REQUIRE(problem->assemble_tangent({u, 0}, K).ok());
    CHECK(product_error(*problem, K, w, Kw) <= 1e-12);
  }
}

TEST_CASE("a further term: equilibrium under a body force, which the springs alone balance") {
  // A uniform displacement strains nothing: k V u (1 + u^2/l^2) = b V.
  const std::string scene = plate("type = \"baqp\"", "[[load]]\nset = \"all\"\nbody_force = [0.4, 0]", "newton");
  const Scene read = parse_scene(scene, "plate.toml", all_parts());
  const std::unique_ptr<BodyProblem> problem = with_foundation(scene);
  Silent observer;
  all_parts().integrator(*read.integrator)->run(*problem, observer);
  double root = 1;
  for (int k = 0; k < 50; ++k)
    root -= (stiffness * root * (1 + root * root / (length * length)) - 0.4) / (stiffness * (1 + 3 * root * root / (length * length)));
  const ConstFieldView u = problem->state().displacement();
  for (const std::int32_t p : problem->body().internal()) {
    CHECK(std::abs(u.component(0)[p] - root) < 1e-8);
    CHECK(std::abs(u.component(1)[p]) < 1e-8);
  }
}

TEST_CASE("a further term: the account of energies holds where bonds fail") {
  const std::unique_ptr<BodyProblem> problem =
      with_foundation(plate("type = \"bond_based\"", "[damage]\ntype = \"critical_stretch\"\nstretch = 0.05"));
  Field u = problem->make_field(), f = u;
  fill(*problem, u, 0.1);
  copy(u, problem->state().displacement());
  double before = 0, after = 0;
  REQUIRE(problem->evaluate_forces({u, 0}, f, &before).ok());
  const BondUpdate update = problem->fracture()->update({u, 0}, 0);
  REQUIRE(update.changed > 0);
  REQUIRE(problem->evaluate_forces({u, 0}, f, &after).ok());
  CHECK(std::abs(before - after - update.dissipated) <= 1e-12 * before);
}
