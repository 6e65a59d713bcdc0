/// When an explicit run looks at the stretches of its body: often enough for bodies that swing.

#include "integrators/verlet/stretch_watch.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>

using namespace perikit;

namespace {

/// The number of steps for which the largest stretch was beyond the margin before an estimate was asked for, at most, while `largest` gives it by step.
template <class Largest>
int longest_delay(int steps, double margin, Largest&& largest) {
  std::array<double, StretchWatch::numbers> kept{};
  StretchWatch watch(kept);
  const auto range = [&](int step) { return StretchRange{1.0, largest(step)}; };
  // Eigenvalues that are expected to rise as the eighth power of a stretch.
  const double tolerated = std::exp(8 * margin);
  watch.estimated(range(0), 0, {1, 1}, tolerated);
  double reference = largest(0);
  int delay = 0, most = 0;
  for (int step = 1; step <= steps; ++step) {
    if (std::log(largest(step) / reference) >= margin) most = std::max(most, ++delay);
    if (watch.due(step) && watch.look(range(step), step)) {
      // It finds the eigenvalue that was expected, and the run goes on with a shorter step.
      watch.estimated(range(step), step, {1, 1}, tolerated);
      return most;
    }
  }
  return most;
}

}  // namespace

TEST_CASE("stretch watch: bodies that swing are looked at while they swing back") {
  // From the reference down, and 12 % up within half a period.
  for (const double period : {40.0, 60.0, 100.0})
    CHECK(longest_delay(200, 0.09, [&](int step) { return 1.2 - 0.12 * std::sin(2 * 3.14159265358979 * step / period); }) <= 6);
}

TEST_CASE("stretch watch: bodies that are stretched evenly are looked at before the margin is used up") {
  for (const double rate : {0.0005, 0.002, 0.01})
    CHECK(longest_delay(1000, 0.09, [&](int step) { return std::exp(rate * step); }) <= 6);
}
