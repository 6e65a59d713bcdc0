#include "run/reduction.hpp"

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>

#include "tests/kit/registry.hpp"
#include "tests/kit/scene_text.hpp"
#include "unit/fake_catalogue.hpp"

using namespace perikit;
using namespace perikit::test;

namespace {

/// A plate of 6 x 5 points at (k + 1/2) 0.5 with one record of its displacement.
std::unique_ptr<Simulation> plate(const std::string& set, const std::string& record, double jitter = 0) {
  return simulation_of(SceneText{.constants = "right = 3.0", .spacing = 0.5, .upper = {3, 2.5}, .lattice = fmt::format("jitter = {}", jitter), .sets = "some = \"" + set + "\"",
                                 .kinematics = "conventional", .material = "type = \"saint_venant_kirchhoff\"\nyoungs_modulus = 1.0\npoisson_ratio = 0.25",
                                 .further = fmt::format("[output]\nhistory = [{{ name = \"u\", set = \"some\", quantity = \"displacement\", component = \"x\", {} }}]", record)});
}

/// What the record gives for u_x = value(x, y) at t.
template <class Value>
double recorded(Simulation& simulation, Value&& value, double t = 0) {
  BodyProblem& problem = simulation.problem();
  for (const std::int32_t p : problem.body().internal()) {
    const Point x = problem.body().position(static_cast<std::size_t>(p));
    problem.state().displacement().component(0)[p] = value(x[0], x[1]);
  }
  PointFields fields(problem, false, false);
  return reduced(simulation.scene().output.history.front(), problem, fields, t);
}

}  // namespace

TEST_CASE(
    "fit: an affine field is found at any place, also outside of the body and on clouds; a column of points has no slope "
    "across") {
  const auto affine = [](double x, double y) { return 0.3 - 0.1 * x + 0.2 * y; };
  for (const double jitter : {0.0, 0.2}) {
    const auto corner = plate("x > 1.5", "reduce = \"fit\", at = [\"right\", 2.5]", jitter);
    CHECK(recorded(*corner, affine) == doctest::Approx(affine(3, 2.5)).epsilon(1e-12));
    CHECK(std::abs(recorded(*corner, [](double x, double y) { return x * y; }) - 7.5) > 0.01);  // no interpolation: a fit
  }
  const auto column = plate("x > 2.5", "reduce = \"fit\", at = [3, 2.5]");
  CHECK(recorded(*column, affine) == doctest::Approx(affine(2.75, 2.5)).epsilon(1e-12));
  // Two columns next to each other span the plane, however long; one whose points lie a little off a line does not: their slope across is noise.
  const auto columns = plate("x > 2", "reduce = \"fit\", at = [3.25, 2.5]");
  CHECK(recorded(*columns, affine) == doctest::Approx(affine(3.25, 2.5)).epsilon(1e-12));
  const auto rough = plate("x > 2.5", "reduce = \"fit\", at = [3, 2.5]", 0.02);
  CHECK(recorded(*rough, [&](double x, double y) { return affine(x, y) + 0.01 * std::sin(40 * y); }) == doctest::Approx(affine(2.75, 2.5)).epsilon(0.02));
  const auto point = plate("x > 2.5 && y > 2", "reduce = \"fit\", at = [3, 2.5]");
  CHECK(recorded(*point, affine) == doctest::Approx(affine(2.75, 2.25)).epsilon(1e-12));
}

TEST_CASE("error: the distance from an exact solution, relative to it, at the time of the sample") {
  const auto plates = plate("x < 1", "reduce = \"error\", exact = \"x*(1 + t)\"");  // columns at x = 0.25 and 0.75
  CHECK(recorded(
            *plates, [](double x, double) { return 3 * x; }, 2) == doctest::Approx(0).epsilon(1e-15));
  CHECK(recorded(*plates, [](double x, double) { return 1.1 * x; }) == doctest::Approx(0.1).epsilon(1e-12));
  CHECK(recorded(*plates, [](double x, double) { return x < 0.5 ? x + 0.25 : x; }) ==
        doctest::Approx(0.25 / std::hypot(0.25, 0.75)).epsilon(1e-12));
  const auto nothing = plate("x < 1", "reduce = \"error\", exact = \"0*x\"");
  CHECK(recorded(*nothing, [](double, double) { return 0; }) == 0);
  CHECK_THROWS_WITH_AS(recorded(*nothing, [](double x, double) { return x; }),
                       "history column u: `exact` is 0 at every point of \"some\" at t = 0, and nothing to relate an error to",
                       RunError);
}

TEST_CASE("moment: of forces about a place, with lever arms to where the points are") {
  const auto plates = plate("x < 1", "reduce = \"sum\"");
  HistoryDescription record = plates->scene().output.history.front();
  record.quantity = "internal_force", record.component = "z", record.reduce = "moment", record.about = {0.5, -1, 0};
  BodyProblem& problem = plates->problem();
  double moment = 0;
  for (const std::int32_t p : problem.body().internal()) {
    const Point x = problem.body().position(static_cast<std::size_t>(p));
    State& state = problem.state();
    state.displacement().component(0)[p] = 0.1 * x[1];
    state.internal_force().component(0)[p] = x[1] - 2 * x[0];
    state.internal_force().component(1)[p] = 3 + x[0] * x[1];
    if (x[0] < 1) moment += (x[0] + 0.1 * x[1] - 0.5) * (3 + x[0] * x[1]) - (x[1] + 1) * (x[1] - 2 * x[0]);
  }
  PointFields fields(problem, false, false);
  CHECK(reduced(record, problem, fields, 0) == doctest::Approx(moment).epsilon(1e-12));
}

TEST_CASE("extent and tip: of the points with a value above a limit, along a direction") {
  const auto plates = plate("x < 2.5", "reduce = \"extent\", above = 1, direction = [3, 4]");
  const auto high = [](double x, double y) { return x > 0.5 && y > 1 ? 2.0 : 1.0; };   // 4 columns from 0.75, rows from 1.25 to 2.25
  CHECK(recorded(*plates, high) == doctest::Approx(0.6 * 1.5 + 0.8 * 1.0).epsilon(1e-12));
  CHECK(recorded(*plates, [](double, double) { return 1; }) == 0);
  const auto lower = plate("x < 2.5", "reduce = \"tip\", above = 1, direction = [-2, 0]");
  CHECK(recorded(*lower, high) == doctest::Approx(-0.75).epsilon(1e-12));
  CHECK(std::isnan(recorded(*lower, [](double, double) { return 1; })));
}

TEST_CASE("a column from others: in any order, of t and constants; not a number where it is divided by zero") {
  const auto plates = plate("x < 1", "reduce = \"sum\" }, { name = \"b\", value = \"2*a + t\" }, { name = \"a\", value = \"u/(strain_energy - right)\"");
  const OutputDescription& output = plates->scene().output;
  CHECK(output.derived == std::vector<std::size_t>{2, 1});
  const ColumnExpression& a = *output.history[2].value;
  CHECK(a.columns() == std::vector<std::string>{"u", "strain_energy"});
  CHECK(a(std::vector{4.0, 5.0}, 0) == 2);   // right = 3
  CHECK(std::isnan(a(std::vector{4.0, 3.0}, 0)));
  CHECK(std::isnan(a(std::vector{0.0, 3.0}, 0)));
  CHECK((*output.history[1].value)(std::vector{4.0}, 0.5) == 8.5);
}

TEST_CASE("at and exact go with their reductions, and these with them") {
  const auto refused = [](const std::string& record) { return message_of([&] { plate("x < 1", record); }); };
  for (const auto& wrong : std::vector<std::pair<std::string, std::string>>{
           {"reduce = \"fit\"", "output.history.0.reduce: found \"fit\" without at; allowed: "},
           {"reduce = \"error\"", "output.history.0.reduce: found \"error\" without exact; allowed: "},
           {"at = [1, 2]", "output.history.0.at: found it with reduce = \"mean\"; allowed: only with reduce = \"fit\""},
           {"reduce = \"max\", exact = \"x\"",
            "output.history.0.exact: found it with reduce = \"max\"; allowed: only with reduce = \"error\""},
           {"reduce = \"fit\", at = [1]", "output.history.0.at: found a list of 1"},
           {"reduce = \"extent\", above = 1", "output.history.0.reduce: found \"extent\" without direction; allowed: "},
           {"reduce = \"tip\", direction = [0, 1]", "output.history.0.reduce: found \"tip\" without above; allowed: a number"},
           {"reduce = \"tip\", above = 1, direction = [0, 0]", "output.history.0.direction: found a direction of no length"},
           {"above = 1", "output.history.0.above: found it with reduce = \"mean\"; allowed: only with reduce = \"extent\" or \"tip\""},
           {"reduce = \"moment\", about = [0, 0]", "output.history.0.reduce: found \"moment\" of displacement; allowed: only of reaction, internal_force, external_force"},
           {"reduce = \"moment\", about = [0, 0]", "output.history.0.component: found \"x\"; allowed: z"},
           {"reduce = \"area\"", "output.history.0.reduce: found \"area\" of displacement; allowed: only of damage"},
           {"reduce = \"mass\"", "output.history.0.reduce: found \"mass\" without piece; allowed: an integer >= 1"},
           {"piece = 1", "output.history.0.piece: found it with reduce = \"mean\"; allowed: only with reduce = \"mass\""},
           {"value = \"time\"", "output.history.0: found quantity, value; allowed: exactly 1"},
           {"reduce = \"sum\" }, { name = \"a\", value = \"u/vv\"", "output.history.1.value: found the expression \"u/vv\": unknown name 'vv' at character 3; allowed: step, time, "},
           {"reduce = \"sum\" }, { name = \"a\", value = \"u/\"", "output.history.1.value: found the expression \"u/\": it ends too early"},
           {"reduce = \"sum\" }, { name = \"right\", value = \"1\" }, { name = \"a\", value = \"right*2\"", "'right' at character 1 is a column and a constant"},
           {"reduce = \"sum\" }, { name = \"a\", value = \"b + u\" }, { name = \"b\", value = \"2*a\"", "output.history.1.value: found \"a\" in a circle: a, b cannot be computed"},
           {"reduce = \"sum\" }, { name = \"a\", value = \"u\", set = \"some\"", "output.history.1.set: found an unknown key; allowed: name, value"},
           {"reduce = \"sum\" }, { name = \"residual\", value = \"u\"", "output.history.1.name: found \"residual\" again"},
           {"reduce = \"error\", exact = \"x + q\"", "output.history.0.exact: "}}) {
    const std::string message = refused(wrong.first);
    CHECK_MESSAGE(contains(message, wrong.second), message);
  }
}
