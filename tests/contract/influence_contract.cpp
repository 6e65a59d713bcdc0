/// What every influence function must fulfil: finite and not negative on (0, 1], the same for one point as for many.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "perikit/body/influence.hpp"
#include "tests/contract/fixture.hpp"

using namespace perikit;
using namespace perikit::contract;

namespace {

constexpr double poison = std::numeric_limits<double>::quiet_NaN();

std::unique_ptr<InfluenceFunction> function_of(const Example& example) {
  return subject().registry.influence(*parse_part(Kind::influence, example.part, example.table, subject().registry));
}

/// From far below any bond of a body up to the horizon and the rounding that families allow beyond it.
std::vector<double> distances() {
  std::vector<double> r{1e-300, 1e-12, 1e-6, 1e-3};
  constexpr int steps = 1000;
  for (int k = 1; k <= steps; ++k) r.push_back(static_cast<double>(k) / steps);
  r.push_back(1.0 + 1e-10);
  return r;
}

std::vector<double> values(const InfluenceFunction& function, const std::vector<double>& r) {
  std::vector<double> omega(r.size(), poison);
  function.evaluate(r, omega);
  return omega;
}

}  // namespace

TEST_CASE("influence: finite, not negative, somewhere positive") {
  for (const Example& example : examples(Kind::influence)) {
    INFO(example.part, " (", example.table, ")");
    const auto function = function_of(example);
    const std::vector<double> r = distances(), omega = values(*function, r);
    for (std::size_t k = 0; k + 1 < r.size(); ++k) {
      // The limit r -> 0 may be infinite (1/r); no body has such bonds.
      if (r[k] < 1e-100) continue;
      CHECK_MESSAGE((std::isfinite(omega[k]) && omega[k] >= 0), "omega(", r[k], ") = ", omega[k]);
    }
    // A bond that rounding puts behind the horizon belongs to the family.
    const double size = *std::max_element(omega.begin() + 4, omega.end() - 1);
    CHECK_MESSAGE(size > 0, "zero everywhere");
    CHECK_MESSAGE(omega.back() >= -1e-9 * size, "omega(1 + 1e-10) = ", omega.back());
    CHECK_MESSAGE(std::isfinite(omega.back()), "omega(1 + 1e-10) = ", omega.back());
  }
}

TEST_CASE("influence: bitwise the same for one point, for many, and again") {
  for (const Example& example : examples(Kind::influence)) {
    INFO(example.part, " (", example.table, ")");
    const auto function = function_of(example);
    const std::vector<double> r = distances(), omega = values(*function, r);
    for (std::size_t k = 0; k < r.size(); ++k) CHECK_MESSAGE(values(*function, {r[k]})[0] == omega[k], "batch and single differ at r = ", r[k]);
    std::vector<double> backwards(r.rbegin(), r.rend()), again = values(*function_of(example), backwards);
    std::reverse(again.begin(), again.end());
    CHECK_MESSAGE(again == omega, "values depend on the order or on the object");
    CHECK(values(*function, {}).empty());
  }
}

TEST_CASE("influence: writes its own output only") {
  for (const Example& example : examples(Kind::influence)) {
    INFO(example.part, " (", example.table, ")");
    const auto function = function_of(example);
    for (const std::size_t n : {std::size_t{1}, std::size_t{7}, std::size_t{33}}) {
      const std::vector<double> r(n, 0.5);
      std::vector<double> guarded(n + 16, -3.0);
      function->evaluate(r, std::span(guarded).subspan(8, n));
      CHECK(std::all_of(guarded.begin(), guarded.begin() + 8, [](double v) { return v == -3.0; }));
      CHECK(std::all_of(guarded.end() - 8, guarded.end(), [](double v) { return v == -3.0; }));
      CHECK(std::all_of(guarded.begin() + 8, guarded.end() - 8, [&](double v) { return v == guarded[8] && v >= 0; }));
    }
  }
}
