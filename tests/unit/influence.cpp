#include <doctest/doctest.h>

#include <array>
#include <cmath>

#include "body/family_limit.hpp"
#include "perikit/core/errors.hpp"
#include "perikit/influence.hpp"
#include "plugin/registry.hpp"
#include "scene/scene.hpp"

using namespace perikit;

namespace {

constexpr std::array radii{0.1, 0.25, 0.5, 0.75, 1.0};

std::array<double, radii.size()> influence(const std::string& type, const std::string& parameters = "") {
  Registry registry;
  registry.add_folder(PERIKIT_PLUGIN_FOLDER);
  std::array<double, radii.size()> omega;
  omega.fill(-1.0);
  registry.influence(*parse_part(Kind::influence, type, parameters, registry))->evaluate(radii, omega);
  CHECK(registry.opened().size() == 1);  // of all the plugins, the one that was asked for
  return omega;
}

void check(const std::array<double, radii.size()>& omega, const std::array<double, radii.size()>& expected) {
  for (std::size_t k = 0; k < radii.size(); ++k) CHECK(omega[k] == doctest::Approx(expected[k]).epsilon(1e-14));
}

}  // namespace

TEST_CASE("influence functions take their values by hand calculation") {
  check(influence("constant"), {1, 1, 1, 1, 1});
  check(influence("inverse"), {10, 4, 2, 4.0 / 3, 1});
  check(influence("cone"), {0.9, 0.75, 0.5, 0.25, 0});
  check(influence("gaussian"), {std::exp(-0.01), std::exp(-0.0625), std::exp(-0.25), std::exp(-0.5625), std::exp(-1.0)});
  check(influence("cubic_spline"), {0.946, 0.71875, 0.25, 0.03125, 0});
}

TEST_CASE("a bond as long as the horizon is so in any units, and has the influence of r = 1, which may be none") {
  for (const double spacing : {1.0, 0.1, 0.3, 0.007, 1e-3, 123.4})
    for (const double lower : {0.0, 0.37, -12.1})
      for (const int cells : {1, 2, 3, 5}) {
        CAPTURE(spacing);
        CAPTURE(lower);
        const double from = lower + 0.5 * spacing, to = lower + (cells + 0.5) * spacing;
        CHECK(relative_length(to - from, cells * spacing) == 1.0);
      }
  CHECK(relative_length(1.0, 2.0) == 0.5);
}

TEST_CASE("a formula in r is an influence function") {
  check(influence("expression", "formula = \"(1 - r)^2 + 0*pi\""), {0.81, 0.5625, 0.25, 0.0625, 0});
  CHECK(influence("expression", "formula = \"exp(-r^2)\"") == influence("gaussian"));
}

TEST_CASE("formulas that are no influence function are refused") {
  for (const char* formula : {"r - 0.5", "1/(r - 0.5)", "log(0*r)", "x + r", "1 +", "", "0/0"}) {
    CAPTURE(formula);
    CHECK_THROWS_AS(influence("expression", std::string("formula = \"") + formula + '"'), InputError);
  }
}
