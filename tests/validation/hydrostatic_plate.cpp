/// Hydrostatic extension of Hashim et al., section 4.1: the error of the displacement over the penalty coefficient.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>

#include "tests/validation/quasi_static.hpp"

using namespace perikit;
using namespace perikit::validation;

namespace {

struct Errors {
  double mean;  ///< relative error of the displacement, eq. 56, without the point in the middle, which does not move
  double side;  ///< relative error of the mean displacement of a side
};

Errors errors(double ratio, double coefficient) {
  const auto simulation = load("hashim/hydrostatic_plate.toml",
                               {fmt::format("family.horizon_ratio={}", ratio), fmt::format("constants.G={}", coefficient)});
  CHECK(run(*simulation).reports.back().residual <= 1e-10);
  BodyProblem& problem = simulation->problem();
  constexpr double strain = 0.61334;
  double sum = 0;
  std::size_t points = 0;
  for (const std::int32_t p : problem.body().internal()) {
    const Point x = problem.body().position(static_cast<std::size_t>(p));
    const double size = strain * std::hypot(x[0], x[1]);
    if (size < 1e-9) continue;
    const FieldView u = problem.state().displacement();
    sum += std::hypot(u.component(0)[p] - strain * x[0], u.component(1)[p] - strain * x[1]) / size;
    ++points;
  }
  return {sum / static_cast<double>(points), mean(*simulation, "right", 0) / (strain * 0.48) - 1};
}

}  // namespace

TEST_CASE("hydrostatic plate: the error has a minimum over the penalty coefficient") {
  // Bounds of our own: the paper's Fig. 11 has curves only, over a G of another scaling.
  CHECK(std::abs(errors(1.015, 1e-4).side) < 0.001);
  const Errors little = errors(2.015, 0.02), enough = errors(2.015, 1.0), much = errors(2.015, 10.0);
  CHECK(std::abs(little.side) < 0.006);
  CHECK_MESSAGE(enough.mean < 0.036, "error ", enough.mean);
  CHECK_MESSAGE(little.mean > 1.5 * enough.mean, "error ", little.mean);
  CHECK_MESSAGE(much.mean > 1.5 * enough.mean, "error ", much.mean);
}

TEST_CASE("hydrostatic plate: a wider horizon needs a larger penalty coefficient") {
  // The sides move too far with too little of it.
  CHECK(errors(2.015, 0.05).side < -0.02);
  CHECK(errors(3.015, 0.15).side > 0.04);
  CHECK(errors(3.015, 0.5).side < -0.04);
}
