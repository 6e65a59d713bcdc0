/// Bar under traction of Partmann et al., section 5.1: the error of its elongation, small lattices.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include "tests/validation/quasi_static.hpp"

using namespace perikit;
using namespace perikit::validation;

namespace {

constexpr double hyperelastic = 0.93911061e-3, linear = 0.95238095e-3;  // [m], eqs. 5.4 and 5.1

/// Relative error of the elongation.
double error(const std::string& kinematics, const std::string& influence, int points, double ratio, double reference) {
  const auto simulation =
      load("partmann/traction_bar.toml", {fmt::format("kinematics={}", kinematics), fmt::format("family.influence={}", influence),
                                          fmt::format("constants.N={}", points), fmt::format("constants.m={}", ratio)});
  CHECK(run(*simulation).reports.back().residual <= 1e-8);
  return mean(*simulation, "end", 0) / reference - 1;
}

}  // namespace

TEST_CASE("traction bar: baqp within 0.3 % from horizon ratio 3 to 4") {
  CHECK(error("baqp", "cubic_spline", 4, 3.015, hyperelastic) == doctest::Approx(-0.0016).epsilon(0.05));
  CHECK(std::abs(error("baqp", "cubic_spline", 5, 3.015, hyperelastic)) < 0.003);
  CHECK(std::abs(error("baqp", "cubic_spline", 5, 3.9, hyperelastic)) < 0.003);
}

TEST_CASE("traction bar: pair laws without surface correction miss the elongation, the more the wider the horizon") {
  CHECK(error("bond_based", "constant", 5, 2.015, linear) == doctest::Approx(0.053).epsilon(0.02));
  const double wide = error("bond_based", "constant", 5, 7.015, linear);
  CHECK_MESSAGE(std::abs(wide - 2.05) < 0.02, "error ", wide);
}
