/// Laws with history under every kinematics that has gradients, on lattices and clouds: each evaluation point keeps its own
/// history, accepted steps advance it, nothing else does.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "perikit/core/parallel.hpp"
#include "setup/problem.hpp"
#include "tests/contract/fixture.hpp"
#include "tests/kit/matrices.hpp"

using namespace perikit;
using namespace perikit::contract;

namespace {

constexpr double step = 1e-3;  ///< length of a step [s]; the law's rates do not see it

BodyOptions rate_body(int dimension, bool cloud, bool mixed) {
  BodyOptions body{.dimension = dimension,
                   .cloud = cloud,
                   .crack = mixed && dimension == 2,
                   .two_materials = mixed,
                   .material = "type = \"hypoelastic\"\nyoungs_modulus = 2.0\npoisson_ratio = 0.3"};
  body.cells = dimension == 3 ? 6 : dimension == 2 ? 9 : 20;
  return body;
}

std::string rate_scene(const Example& kinematics, int dimension, bool cloud, bool mixed) {
  return scene_text(rate_body(dimension, cloud, mixed), kinematics_table(kinematics));
}

/// check(problem) for every kinematics with gradients in every dimension, on lattices and clouds; half of them with a second
/// material without history, cracked in 2D (small bodies in 3D would fall apart).
void for_every_model(const std::function<void(BodyProblem&)>& check) {
  for (const Example& example : examples(Kind::kinematics))
    for (int d = 1; d <= 3; ++d)
      for (const bool cloud : {false, true})
        for (const bool mixed : {false, true}) {
          INFO(fmt::format("{} ({}) {}D {}{}", example.part, example.table, d, cloud ? "cloud" : "lattice",
                           mixed ? " two materials" : ""));
          if (!Case{example, {}}.conservative()) {
            CHECK_THROWS_WITH_AS(build(rate_scene(example, d, cloud, mixed)), doctest::Contains("force_state"), InputError);
            continue;
          }
          const auto simulation = build(rate_scene(example, d, cloud, mixed));
          if (simulation->problem().terms().has_gradients()) check(simulation->problem());
        }
}

std::vector<double> kept(const BodyProblem& problem) {
  const std::span<const double> values = std::as_const(*problem.terms().material_points()).values();
  return {values.begin(), values.end()};
}

struct Response {
  double energy = 0;
  Field force;
};

/// Energies and forces on all points agree to the bit.
bool same(const BodyProblem& problem, const Response& a, const Response& b) {
  bool equal = a.energy == b.energy;
  for (const std::int32_t p : problem.body().internal())
    for (int c = 0; c < problem.dimension(); ++c) equal = equal && a.force.component(c)[p] == b.force.component(c)[p];
  return equal;
}

Response respond(BodyProblem& problem, ConstFieldView u, double time_step) {
  Response r{0, problem.make_field()};
  r.force.fill(std::numeric_limits<double>::quiet_NaN());
  const EvaluationStatus status = problem.evaluate_forces({u, 0, time_step}, r.force, &r.energy);
  REQUIRE_MESSAGE(status.ok(), status.description);
  return r;
}

Field deformed(const BodyProblem& problem, std::uint64_t seed, double noise) {
  Field u = problem.make_field();
  deform(problem.body(), u, seed, noise);
  return u;
}

/// Three steps of a path; the last response.
Response walk(BodyProblem& problem) {
  Response r;
  for (const std::uint64_t seed : {31, 32, 33}) {
    r = respond(problem, deformed(problem, seed, 0.01), step);
    problem.advance(step);
  }
  return r;
}

/// x + u turned by an angle about the third axis, as a displacement.
Field turned(const BodyProblem& problem, ConstFieldView u, double angle) {
  const Body& body = problem.body();
  Field v = problem.make_field();
  const double c = std::cos(angle), s = std::sin(angle);
  for (const std::int32_t p : body.internal()) {
    const Point x = body.position(static_cast<std::size_t>(p));
    const double a = x[0] + u.component(0)[p], b = x[1] + u.component(1)[p];
    v.component(0)[p] = c * a - s * b - x[0];
    v.component(1)[p] = s * a + c * b - x[1];
    if (problem.dimension() == 3) v.component(2)[p] = u.component(2)[p];
  }
  return v;
}

}  // namespace

TEST_CASE("kinematics: only finished steps advance the history of rate laws") {
  for_every_model([](BodyProblem& problem) {
    walk(problem);
    const std::vector<double> before = kept(problem);
    CHECK_MESSAGE(std::any_of(before.begin(), before.end(), [](double x) { return x != 0; }), "no history is kept");
    const Field u = deformed(problem, 34, 0.01), w = deformed(problem, 35, 0.5);
    Field Kw = problem.make_field();
    PointSamples samples;
    const Response one = respond(problem, u, step), two = respond(problem, u, 0.0), three = respond(problem, u, step);
    CHECK_MESSAGE((same(problem, one, two) && same(problem, one, three)), "an evaluation depends on the one before");
    REQUIRE(problem.tangent_action({u, 0}, w, Kw).ok());
    REQUIRE(problem.terms().sample({u, 0}, samples).ok());
    CHECK_MESSAGE(kept(problem) == before, "an evaluation advanced the history");
    problem.advance(step);
    CHECK_MESSAGE(kept(problem) != before, "a step did not advance the history");
    // At the end of the step the increment is zero: the same stress, from the history alone.
    CHECK_MESSAGE(same(problem, respond(problem, u, 0.0), one),
                  "the state at the end of the step is not the one that was put aside");
    PointSamples after;
    REQUIRE(problem.terms().sample({u, 0}, after).ok());
    double total = 0, scale = 0;
    for (const std::int32_t p : problem.body().internal()) {
      total += after.strain_energy_density.data()[p] * problem.body().volume(static_cast<std::size_t>(p));
      scale += std::abs(after.strain_energy_density.data()[p]) * problem.body().volume(static_cast<std::size_t>(p));
    }
    CHECK_MESSAGE(std::abs(total - one.energy) <= 1e-11 * scale, "sampled energy ", total, " against ", one.energy);
  });
}

TEST_CASE("kinematics: fields of states are averages over evaluation points by their weights") {
  for_every_model([](BodyProblem& problem) {
    walk(problem);
    PointSamples samples{.asked = Sampling::cauchy | Sampling::H};
    REQUIRE(problem.terms().sample({deformed(problem, 33, 0.01), 0}, samples).ok());
    const std::span<const std::int32_t> points = problem.body().internal();
    const int d = problem.dimension(), components = d == 3 ? 6 : d == 2 ? 4 : 3;
    const std::vector<int> diagonal = d == 3 ? std::vector{0, 3, 5} : d == 2 ? std::vector{0, 2, 3} : std::vector{0, 1, 2};
    const auto average = [&](std::string_view name) {
      std::vector<double> values(points.size() * static_cast<std::size_t>(components), std::numeric_limits<double>::quiet_NaN());
      problem.terms().average_state(name, static_cast<std::size_t>(components), points, values);
      return values;
    };
    const std::vector<double> stress = average("unrotated_stress"), stretch = average("stretch");
    double scale = 0, worst = 0, worst_stretch = 0;
    bool others = true;
    for (std::size_t k = 0; k < points.size(); ++k) {
      const auto p = static_cast<std::size_t>(points[k]);
      if (problem.laws().record_of(p).material->state_components(problem.laws().space()) == 0) {
        others = others && stress[k * static_cast<std::size_t>(components)] == 0;
        continue;
      }
      // sigma = R s R^T has the trace of s at every evaluation point.
      double trace = 0, of_cauchy = 0;
      for (std::size_t a = 0; a < 3; ++a) {
        trace += stress[k * static_cast<std::size_t>(components) + static_cast<std::size_t>(diagonal[a])];
        of_cauchy += samples.cauchy.component(static_cast<int>(4 * a))[p];
      }
      scale = std::max(scale, std::abs(of_cauchy));
      worst = std::max(worst, std::abs(trace - of_cauchy));
      if (d == 1) worst_stretch = std::max(worst_stretch, std::abs(stretch[3 * k] - samples.H.component(0)[p]));
    }
    CHECK(scale > 0);
    CHECK_MESSAGE(worst <= 1e-12 * scale, "the trace of the mean stress is off by ", worst, " of ", scale);
    CHECK_MESSAGE(worst_stretch <= 1e-14, "stretches are off by ", worst_stretch);
    CHECK_MESSAGE(others, "a law without the variable has values of it");
  });
}

TEST_CASE("kinematics: a rigid rotation turns the forces of rate laws and does no work") {
  for_every_model([](BodyProblem& problem) {
    if (problem.dimension() == 1) return;
    const Response r = walk(problem);
    constexpr double angle = 1.1;
    const Field u = deformed(problem, 33, 0.01);
    const Response q = respond(problem, turned(problem, u, angle), step);
    const double c = std::cos(angle), s = std::sin(angle), scale = largest(problem.body(), r.force);
    double worst = 0;
    for (const std::int32_t p : problem.body().internal()) {
      const double x = r.force.component(0)[p], y = r.force.component(1)[p];
      worst = std::max(
          {worst, std::abs(q.force.component(0)[p] - (c * x - s * y)), std::abs(q.force.component(1)[p] - (s * x + c * y))});
    }
    CHECK_MESSAGE(worst <= 1e-10 * scale, "forces off by ", worst, " of ", scale);
    CHECK_MESSAGE(std::abs(q.energy - r.energy) <= 1e-11 * std::abs(r.energy), q.energy, " against ", r.energy);
  });
}

TEST_CASE("kinematics: the tangent of rate laws is the derivative of a step's forces") {
  for_every_model([](BodyProblem& problem) {
    walk(problem);
    const Field u = deformed(problem, 34, 0.01);
    const Field w = random_direction(problem, 36);
    Field Kw = problem.make_field();
    REQUIRE(problem.tangent_action({u, 0}, w, Kw).ok());
    const double h = 5e-4 * problem.body().spacing();
    const auto force = [&](double by) { return respond(problem, shifted(problem, u, w, by), 0.0).force; };
    const Field a = force(-2 * h), b = force(-h), c = force(h), d = force(2 * h);
    double worst = 0;
    for (const std::int32_t p : problem.body().internal())
      for (int k = 0; k < problem.dimension(); ++k) {
        const double slope = (8 * (c.component(k)[p] - b.component(k)[p]) - (d.component(k)[p] - a.component(k)[p])) / (12 * h);
        worst = std::max(worst, std::abs(slope + Kw.component(k)[p]));
      }
    CHECK_MESSAGE(worst <= 1e-7 * largest(problem.body(), Kw), "tangent off by ", worst, " of ", largest(problem.body(), Kw));
    BlockMatrix K;
    REQUIRE(problem.assemble_tangent({u, 0, step}, K).ok());
    CHECK_FALSE(K.symmetric);
    const double off = test::product_error(problem, K, w, Kw);
    CHECK_MESSAGE(off <= 1e-11, "the assembled tangent is off by ", off);
  });
}

TEST_CASE("kinematics: rate laws are the same for any number of threads, and restored runs go on bitwise") {
  const int threads = thread_count();
  for_every_model([&](BodyProblem& problem) {
    const std::vector<std::byte> fresh = problem.snapshot();
    set_thread_count(1);
    const Response one = walk(problem);
    const std::vector<double> history = kept(problem);
    const std::vector<std::byte> after = problem.snapshot();
    const Field u = deformed(problem, 37, 0.01);
    const Response next = respond(problem, u, step);
    problem.restore(fresh);
    set_thread_count(2);
    CHECK_MESSAGE((same(problem, walk(problem), one) && kept(problem) == history), "depends on the number of threads");
    problem.advance(step);  // something else
    problem.restore(after);
    CHECK_MESSAGE(same(problem, respond(problem, u, step), next), "a restored run differs");
  });
  set_thread_count(threads);
}

TEST_CASE("kinematics: a step of rate laws that is given up changes nothing, and one that is accepted counts once") {
  for_every_model([](BodyProblem& problem) {
    walk(problem);
    const std::vector<std::byte> start = problem.snapshot();
    const std::vector<double> before = kept(problem);
    const Field u = deformed(problem, 38, 0.01), elsewhere = deformed(problem, 39, 0.02);
    respond(problem, u, step);
    problem.accept();
    const std::vector<double> after = kept(problem);
    CHECK(after != before);
    problem.accept();
    CHECK_MESSAGE(kept(problem) == after, "a step was accepted twice");
    problem.restore(start);
    respond(problem, elsewhere, step);
    problem.revert();
    problem.accept();
    CHECK_MESSAGE(kept(problem) == before, "a step that was given up was accepted");
    respond(problem, elsewhere, step);   // an iteration on the way
    respond(problem, u, step);
    problem.accept();
    CHECK_MESSAGE(kept(problem) == after, "iterations leave something behind");
  });
}

TEST_CASE("kinematics: rate laws evaluate symmetric bonds once: the same forces and work as from both ends") {
  for (const Example& example : examples(Kind::kinematics))
    for (int d = 1; d <= 3; ++d)
      for (const bool cloud : {false, true})
        for (const bool mixed : {false, true}) {
          INFO(fmt::format("{} ({}) {}D {}{}", example.part, example.table, d, cloud ? "cloud" : "lattice", mixed ? " two materials" : ""));
          if (!formulation_of(example).pair_symmetric) continue;
          BodyOptions body = rate_body(d, cloud, mixed);
          const auto once = build(scene_text(body, kinematics_table(example)));
          body.share = false;
          const auto twice = build(scene_text(body, kinematics_table(example)));
          CHECK(2 * once->problem().report().evaluation_points == twice->problem().report().evaluation_points);
          CHECK_MESSAGE((d == 1 || mixed || formulation_of(example).selective() || kept(once->problem()).size() < 0.7 * static_cast<double>(kept(twice->problem()).size())),
                        "both ends keep a history of their own");
          const Response a = walk(once->problem()), b = walk(twice->problem());
          const double worst = difference(once->problem().body(), a.force, b.force);
          CHECK_MESSAGE(worst <= 1e-11 * largest(once->problem().body(), a.force), "forces off by ", worst);
          CHECK_MESSAGE(std::abs(a.energy - b.energy) <= 1e-11 * std::abs(a.energy), a.energy, " against ", b.energy);
        }
}

TEST_CASE("kinematics: rate laws leave out what no wave has reached, and not a bit of the result changes") {
  for (const Example& example : examples(Kind::kinematics))
    for (int d = 1; d <= 2; ++d)
      for (const bool cloud : {false, true}) {
        INFO(fmt::format("{} ({}) {}D {}", example.part, example.table, d, cloud ? "cloud" : "lattice"));
        if (!Case{example, {}}.conservative() || formulation_of(example).pairs) continue;
        BodyOptions body = rate_body(d, cloud, false);
        body.cells = d == 1 ? 3000 : 96;
        const auto some = build(scene_text(body, kinematics_table(example)));
        body.skip = false;
        const auto all = build(scene_text(body, kinematics_table(example)));
        // All is at rest, one end moves, moves on, and comes back to rest with a stress that its history keeps; then the other end.
        const Body& points = some->problem().body();
        const auto moved = [&](std::uint64_t seed, double lower, double upper, double size) {
          Field u = some->problem().make_field();
          Noise noise(seed);
          set_field(points, u, [&](const Point& x) {
            const double by = x[0] >= lower && x[0] < upper ? size * points.spacing() : 0.0;
            return Point{by * noise(), by * noise(), by * noise()};
          });
          return u;
        };
        double high = 0;
        for (const std::int32_t p : points.internal()) high = std::max(high, points.position(static_cast<std::size_t>(p))[0]);
        for (const Field& u : {moved(70, 0, 0, 0.0), moved(71, -9, 3, 0.03), moved(72, -9, 4, 0.03), moved(73, 0, 0, 0.0), moved(74, high - 3, 2 * high, 0.03)}) {
          const Response a = respond(some->problem(), u, step), b = respond(all->problem(), u, step);
          CHECK_MESSAGE(same(some->problem(), a, b), "the result is another one");
          some->problem().advance(step);
          all->problem().advance(step);
        }
        CHECK(kept(some->problem()) == kept(all->problem()));
        CHECK(some->problem().report().resting.quiet > 0);
        CHECK(all->problem().report().resting.blocks == 0);
      }
}
