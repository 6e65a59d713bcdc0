/// What a penalty must fulfil beyond the suite of every kinematics, which runs over `conventional` with each example.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>

#include "tests/contract/fixture.hpp"
#include "tests/contract/reference_body.hpp"

using namespace perikit;
using namespace perikit::contract;

namespace {

struct Result {
  Field force, stiffness;
  double energy = 0;
};

/// Forces, energy and tangent action of the problem's displacement.
Result evaluate(BodyProblem& problem, ConstFieldView w) {
  Result r{problem.make_field(), problem.make_field()};
  REQUIRE(problem.evaluate_forces({problem.state().displacement(), 0}, r.force, &r.energy).ok());
  REQUIRE(problem.tangent_action({problem.state().displacement(), 0}, w, r.stiffness).ok());
  return r;
}

}  // namespace

TEST_CASE("stabilization: what it adds agrees with the dense reference") {
  constexpr double tolerance = 1e-11;   // of the sums that hold it
  for (const Example& example : examples(Kind::stabilization)) {
    if (example.part != "silling" && example.part != "wan") continue;
    const auto part = parse_part(Kind::stabilization, example.part, example.table, subject().registry);
    const bool whole = part->values.text("fit") == "whole";
    const double coefficient = part->values.has("coefficient") ? part->values.number("coefficient") : 1.0;
    for (int d = 1; d <= 3; ++d)
      for (const bool cloud : {false, true})
        for (const bool crack : {false, true})
          for (const auto& space : {std::pair{"strain", 1}, std::pair{"strain", 2}, std::pair{"stress", 1}}) {
            if (!whole && space.second == 1) continue;   // the same
            const std::string plane = space.first;
            const int order = space.second;
            if ((crack && (d == 1 || plane == "stress")) || (plane == "stress" && d == 3)) continue;
            INFO(fmt::format("{} ({}) {}D {}{} {} order {}", example.part, example.table, d, cloud ? "cloud" : "lattice", crack ? " cracked" : "", plane, order));
            BodyOptions options;
            options.dimension = d;
            options.cloud = cloud;
            options.crack = crack;
            options.plane = plane;
            options.cells = d == 3 ? 7 : d == 2 ? 10 : 20;
            const std::string table = example.table.empty() ? "" : ", " + example.table;
            const std::string kinematics = fmt::format("type = \"conventional\"\norder = {}", order);
            const auto plain = build(scene_text(options, kinematics));
            const auto with = build(scene_text(options, fmt::format("{}\nstabilization = {{ type = \"{}\"{} }}", kinematics, example.part, table)));
            const Body& body = with->problem().body();
            Field w = body.make_field(d);
            deform(body, w, 72, 0.5);
            for (Simulation* simulation : {plain.get(), with.get()}) deform(body, simulation->problem().state().displacement(), 71, 0.02);
            const Result base = evaluate(plain->problem(), w), sum = evaluate(with->problem(), w);
            const auto influence = subject().registry.influence(*with->scene().influence);
            const reference::Matrix S = reference::stabilization(cloud_of(body, *influence), example.part, elasticity(body), coefficient, order, 1e-8, whole);
            const reference::Vector u = dense(body, with->problem().state().displacement());
            const reference::Vector force = dense(body, sum.force) - dense(body, base.force), stiffness = dense(body, sum.stiffness) - dense(body, base.stiffness);
            CHECK((force + S * u).cwiseAbs().maxCoeff() <= tolerance * dense(body, sum.force).cwiseAbs().maxCoeff());
            CHECK((stiffness - S * dense(body, w)).cwiseAbs().maxCoeff() <= tolerance * dense(body, sum.stiffness).cwiseAbs().maxCoeff());
            CHECK(std::abs(sum.energy - base.energy - u.dot(S * u) / 2) <= tolerance * sum.energy);
            CHECK(sum.energy > base.energy);
          }
  }
}

TEST_CASE("stabilization: a sawtooth, which the point gradient does not see, stores energy") {
  for (const Example& example : kinematics_examples()) {
    if (example.stabilization.empty()) continue;
    for (int d = 1; d <= 3; ++d)
      for (const bool cloud : {false, true}) {
        INFO(fmt::format("{} {}D {}", example.stabilization, d, cloud ? "cloud" : "lattice"));
        BodyOptions options;
        options.dimension = d;
        options.cloud = cloud;
        const auto energy = [&](const std::string& kinematics) {
          const auto simulation = build(scene_text(options, kinematics));
          BodyProblem& problem = simulation->problem();
          set_field(problem.body(), problem.state().displacement(), [](const Point& x) {
            return Point{(static_cast<int>(std::floor(x[0]) + std::floor(x[1]) + std::floor(x[2])) % 2 == 0 ? 0.05 : -0.05), 0, 0};
          });
          Field f = problem.body().make_field(d);
          double sum = 0;
          REQUIRE(problem.evaluate_forces({problem.state().displacement(), 0}, f, &sum).ok());
          return sum;
        };
        // Surfaces and jitter make the plain gradient see a little of it.
        CHECK(energy(kinematics_table(example)) > 3 * energy("type = \"conventional\""));
      }
  }
}

TEST_CASE("stabilization: horizons of more cells than the lattice kernels buffer") {
  for (const Example& example : kinematics_examples()) {
    if (example.stabilization.empty() || !example.table.empty()) continue;
    for (int d = 1; d <= 3; ++d) {
      INFO(fmt::format("{} {}D", example.stabilization, d));
      BodyOptions options;
      options.dimension = d;
      options.horizon_ratio = 17.2;
      options.cells = d == 1 ? 50 : 19;
      const auto plain = build(scene_text(options, "type = \"conventional\"")), with = build(scene_text(options, kinematics_table(example)));
      const Body& body = with->problem().body();
      // What the penalty adds is quadratic: E(u + w) - E(u - w) = -2 f(u) . w, exactly.
      Field u = body.make_field(d), w = body.make_field(d), f = body.make_field(d);
      deform(body, u, 81, 0.02);
      deform(body, w, 82, 0.02);
      double scale = 0;
      const auto energy = [&](double step) {
        for (std::size_t k = 0; k < u.size(); ++k) plain->problem().state().displacement().data[k] = with->problem().state().displacement().data[k] = u.data()[k] + step * w.data()[k];
        double base = 0, sum = 0;
        REQUIRE(plain->problem().evaluate_forces({plain->problem().state().displacement(), 0}, plain->problem().state().internal_force(), &base).ok());
        REQUIRE(with->problem().evaluate_forces({with->problem().state().displacement(), 0}, with->problem().state().internal_force(), &sum).ok());
        scale = std::max(scale, sum);
        return sum - base;
      };
      const double difference = energy(1) - energy(-1);
      energy(0);
      for (std::size_t k = 0; k < f.size(); ++k) f.data()[k] = with->problem().state().internal_force().data[k] - plain->problem().state().internal_force().data[k];
      CHECK(std::abs(difference + 2 * dot(body, f, w)) <= 1e-11 * scale);
      CHECK(std::abs(difference) > 1e-7 * scale);
    }
  }
}

TEST_CASE("stabilization: refused over kinematics that leave nothing over") {
  for (const Example& example : examples(Kind::stabilization)) {
    const auto scene = [&](const std::string& kinematics) {
      return scene_text({}, fmt::format("{}\nstabilization = {{ type = \"{}\"{}{} }}", kinematics, example.part, example.table.empty() ? "" : ", ", example.table));
    };
    for (const auto& [kinematics, found] : {std::pair{"type = \"baqp\"", "over baqp; allowed: over kinematics with one gradient per point"},
                                            std::pair{"type = \"ordinary\"", "over ordinary; allowed"}}) {
      CHECK_THROWS_WITH_AS(build(scene(kinematics)), doctest::Contains(found), InputError);
      CHECK_THROWS_WITH_AS(build(scene(kinematics)), doctest::Contains("kinematics.stabilization: found"), InputError);
    }
  }
}
