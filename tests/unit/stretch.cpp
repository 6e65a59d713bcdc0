/// Extension and direction of deformed bonds, families/stretch.hpp.

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <random>

#include "families/stretch.hpp"

using namespace perikit;

namespace {

/// A bond of random xi whose far end has moved to `kept` of it from the near end: y = kept xi.
struct Shortened {
  double xi[3], du[3], length;

  Shortened(std::mt19937& random, double kept) {
    std::uniform_real_distribution<double> number(-1.0, 1.0);
    double square = 0;
    for (int c = 0; c < 3; ++c) {
      xi[c] = number(random);
      du[c] = kept == 0 ? -xi[c] : (kept - 1.0) * xi[c];
      square += xi[c] * xi[c];
    }
    length = std::sqrt(square);
  }
  Stretch<3> stretch() const noexcept { return {{xi[0], xi[1], xi[2]}, length, {du[0], du[1], du[2]}}; }
  bool has_length() const noexcept { return stretch().has_length(length)[0]; }
};

}  // namespace

TEST_CASE("a bond whose ends meet is found, whatever the rounding of its length") {
  std::mt19937 random(5);
  for (int n = 0; n < 1000; ++n)
    for (const double kept : {0.0, 1e-12, -1e-9}) CHECK(!Shortened(random, kept).has_length());
}

TEST_CASE("a bond that is not finite is found") {
  std::mt19937 random(6);
  for (const double wrong : {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN(), 1e200}) {
    Shortened bond(random, 1.0);
    bond.du[1] = wrong;
    CHECK(!bond.has_length());
  }
}

TEST_CASE("extension and direction of bonds, shortened, turned over and stretched") {
  std::mt19937 random(7);
  for (int n = 0; n < 1000; ++n)
    for (const double kept : {1e-4, -0.5, -1.0, 0.5, 1.0, 3.0, 1e6}) {
      const Shortened bond(random, kept);
      const Stretch<3> found = bond.stretch();
      // |y|^2 = |xi|^2 + du . (xi + y) is exact to rounding of |xi|^2 (|y|^2 where that is larger).
      const double size = std::abs(kept), direction = 1e-15 * (1 + 4 / (size * size));
      REQUIRE(bond.has_length());
      CHECK(found.e[0] == doctest::Approx((size - 1) * bond.length).epsilon(1e-14 * (1 + 1 / size)));
      for (int c = 0; c < 3; ++c) CHECK(std::abs((found.y[c] * found.inverse_length)[0] - std::copysign(bond.xi[c] / bond.length, kept * bond.xi[c])) <= direction);
    }
}
