/// What the assembled tangent of every kinematics must fulfil with every material: it is the tangent action, symmetric, bitwise
/// the same for any number of threads and with a pattern that is there already.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "perikit/core/parallel.hpp"
#include "tests/contract/fixture.hpp"
#include "tests/kit/matrices.hpp"

using namespace perikit;
using namespace perikit::contract;

namespace {

/// Laws without history: those with one run explicitly only and are never assembled.
struct Law {
  std::string table;
  double shear_modulus;  ///< of the unstrained material at a point [Pa]
};

double shear_modulus_of(const std::string& table) {
  BodyOptions body;
  body.dimension = 1;
  body.material = table;
  return build(scene_text(body, "type = \"conventional\""))->problem().laws().moduli(0).mu;
}

std::vector<Law> materials() {
  std::vector<Law> all;
  Registry& registry = subject().registry;
  for (const std::string& name : registry.names(Kind::material)) {
    for (const std::string& table : registry.describe(Kind::material, name).examples) {
      if (!registry.material(*parse_part(Kind::material, name, table, registry))->traits().hyperelastic) continue;
      const std::string text = fmt::format("type = \"{}\"\n{}", name, table);
      all.push_back({text, shear_modulus_of(text)});
    }
  }
  return all;
}

BlockMatrix assembled(BodyProblem& problem, ConstFieldView u) {
  BlockMatrix K;
  const EvaluationStatus status = problem.assemble_tangent({u, 0}, K);
  REQUIRE_MESSAGE(status.ok(), status.description);
  return K;
}

double largest_value(const BlockMatrix& K) {
  double most = 0;
  for (const double value : K.values) most = std::isnan(value) ? INFINITY : std::max(most, std::abs(value));
  return most;
}

/// Largest difference of a block from the transpose of its mirror; infinite where the mirror is missing.
double asymmetry(const BlockMatrix& K) {
  double worst = 0;
  const auto d = static_cast<std::size_t>(K.dimension);
  for (std::size_t r = 0; r < K.rows(); ++r)
    for (auto b = static_cast<std::size_t>(K.row_first[r]); b < static_cast<std::size_t>(K.row_first[r + 1]); ++b) {
      const auto column = static_cast<std::size_t>(K.column[b]);
      const auto begin = K.column.begin() + K.row_first[column], end = K.column.begin() + K.row_first[column + 1];
      const auto found = std::lower_bound(begin, end, static_cast<std::int32_t>(r));
      if (found == end || *found != static_cast<std::int32_t>(r)) return INFINITY;
      const auto mirror = static_cast<std::size_t>(found - K.column.begin());
      for (std::size_t a = 0; a < d; ++a)
        for (std::size_t c = 0; c < d; ++c)
          worst = std::max(worst, std::abs(K.values[(b * d + a) * d + c] - K.values[(mirror * d + c) * d + a]));
    }
  return worst;
}

bool same_pattern(const BlockMatrix& a, const BlockMatrix& b) {
  return a.point == b.point && a.row_first == b.row_first && a.column == b.column;
}

}  // namespace

TEST_CASE("kinematics: the assembled tangent is the tangent action and symmetric, with every hyperelastic material") {
  const std::vector<Law> laws = materials();
  std::size_t next = 0;
  for (Case c : cases_and_tongues()) {
    // In 3D, where a matrix takes the longest, they take turns.
    const bool turns = c.body.dimension == 3;
    const std::size_t begin = turns ? next++ % laws.size() : 0, end = turns ? begin + 1 : laws.size();
    for (std::size_t k = begin; k < end; ++k) {
      const std::string& material = laws[k].table;
      c.body.material = material;
      // The other material is half as stiff: a laminate with one that is a million times softer gives that one all of the strain.
      c.body.modulus = laws[k].shear_modulus;
      INFO(c.label(), " ", material);
      const auto simulation = build(scene_text(c.body, kinematics_table(c.example)));
      BodyProblem& problem = simulation->problem();
      const Body& body = problem.body();
      deform(body, problem.state().displacement(), 71, 0.02);
      const Field w = random_direction(problem, 72);
      Field expected = problem.make_field();
      expected.fill(std::numeric_limits<double>::quiet_NaN());
      REQUIRE(problem.tangent_action({problem.state().displacement(), 0}, w, expected).ok());
      const BlockMatrix K = assembled(problem, problem.state().displacement());
      REQUIRE(K.dimension == body.dimension());
      REQUIRE(K.rows() == body.points());
      CHECK(std::is_sorted(K.point.begin(), K.point.end()));
      REQUIRE(largest(body, expected) > 0);
      const double off = test::product_error(problem, K, w, expected);
      CHECK_MESSAGE(off <= 1e-12, "K w is off by ", off);
      CHECK(K.symmetric == c.conservative());
      if (c.conservative()) CHECK_MESSAGE(asymmetry(K) <= 1e-12 * largest_value(K), "asymmetric by ", asymmetry(K) / largest_value(K));
      else CHECK_MESSAGE(asymmetry(K) > 1e-12 * largest_value(K), "declared as not conservative, but its tangent is symmetric");
    }
  }
}

TEST_CASE("kinematics: the assembled tangent is bitwise the same for one and two threads and with a known pattern") {
  for (const Case& c : cases()) {
    INFO(c.label());
    BodyOptions options = c.body;
    if (options.dimension == 1) options.cells = 2000;
    if (options.dimension == 2) options.cells = 36;
    const auto simulation = build(scene_text(options, kinematics_table(c.example)));
    BodyProblem& problem = simulation->problem();
    deform(problem.body(), problem.state().displacement(), 81, 0.02);
    const int threads = thread_count();
    set_thread_count(1);
    const BlockMatrix one = assembled(problem, problem.state().displacement());
    set_thread_count(2);
    BlockMatrix two = assembled(problem, problem.state().displacement());
    set_thread_count(threads);
    CHECK(same_pattern(one, two));
    CHECK_MESSAGE(one.values == two.values, "the values depend on the number of threads");
    // A second state into the same matrix, and back.
    const Field rest = problem.make_field();
    const double* values = two.values.data();
    REQUIRE(problem.assemble_tangent({rest, 0}, two).ok());
    CHECK(one.values != two.values);
    REQUIRE(problem.assemble_tangent({problem.state().displacement(), 0}, two).ok());
    CHECK(values == two.values.data());
    CHECK(same_pattern(one, two));
    CHECK_MESSAGE(one.values == two.values, "the values depend on what was there before");
  }
}

TEST_CASE("kinematics: the size of an assembled tangent is known before") {
  for (const Case& c : cases()) {
    INFO(c.label());
    const auto simulation = build(scene_text(c.body, kinematics_table(c.example)));
    BodyProblem& problem = simulation->problem();
    const AssembledSize size = problem.assembled_size();
    const BlockMatrix K = assembled(problem, problem.state().displacement());
    const double ratio = static_cast<double>(size.blocks) / static_cast<double>(K.blocks());
    if (problem.body().points() <= 256) CHECK(size.blocks == K.blocks());
    CHECK(std::abs(ratio - 1) <= 0.05);
    CHECK(size.bytes > K.values.size() * sizeof(double) * 9 / 10);
  }
}

TEST_CASE("kinematics: assembling reports an inadmissible deformation") {
  for (const Case& c : cases()) {
    BodyOptions options = c.body;
    if (options.crack || options.plane == "stress") continue;
    INFO(c.label());
    const auto simulation = build(scene_text(options, kinematics_table(c.example)));
    BodyProblem& problem = simulation->problem();
    const Body& body = problem.body();
    // Inside out, or (pair laws) all on one point.
    const double factor = problem.terms().has_gradients() ? -1.5 : -1.0;
    set_field(body, problem.state().displacement(), [&](const Point& x) { return Point{factor * x[0], 0, 0}; });
    if (!problem.terms().has_gradients())
      set_field(body, problem.state().displacement(), [&](const Point& x) { return Point{-x[0], -x[1], -x[2]}; });
    Field f = problem.make_field();
    const EvaluationStatus expected = problem.evaluate_forces({problem.state().displacement(), 0}, f, nullptr);
    BlockMatrix K;
    const EvaluationStatus status = problem.assemble_tangent({problem.state().displacement(), 0}, K);
    REQUIRE(!expected.ok());
    CHECK(!status.ok());
    CHECK(status.description.find("point") != std::string::npos);
  }
}
