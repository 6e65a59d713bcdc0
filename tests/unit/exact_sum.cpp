#include "perikit/core/exact_sum.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <utility>
#include <vector>

using namespace perikit;

namespace {

double sum_of(const std::vector<double>& terms) {
  ExactSum sum;
  for (const double x : terms) sum.add(x);
  return sum.value();
}

/// Of all magnitudes, signs and subnormals among them.
std::vector<double> spread(std::mt19937_64& random, std::size_t n, int least, int most) {
  std::uniform_real_distribution<double> mantissa(-1, 1);
  std::uniform_int_distribution<int> exponent(least, most);
  std::vector<double> x(n);
  for (double& value : x) value = std::ldexp(mantissa(random), exponent(random));
  return x;
}

}  // namespace

TEST_CASE("exact_sum: small cases") {
  CHECK(sum_of({}) == 0.0);
  CHECK(sum_of({1.5}) == 1.5);
  CHECK(sum_of({-0.1}) == -0.1);
  CHECK(sum_of({1e300, 1.0, -1e300}) == 1.0);
  CHECK(sum_of({1.0, 0x1p-53}) == 1.0);                       // a tie goes to even
  CHECK(sum_of({1.0, 0x1p-53, 0x1p-1074}) == 1.0 + 0x1p-52);  // and the smallest number decides
  CHECK(sum_of({-1.0, -0x1p-53, -0x1p-200}) == -1.0 - 0x1p-52);
  CHECK(sum_of({1.0 + 0x1p-52, 0x1p-53}) == 1.0 + 0x1p-51);
  CHECK(sum_of({5e-324, 5e-324}) == 1e-323);
  CHECK(sum_of({std::numeric_limits<double>::max(), -std::numeric_limits<double>::max()}) == 0.0);
  CHECK(std::isnan(sum_of({1.0, std::nan("")})));
  CHECK(std::isnan(sum_of({1.0, INFINITY})));
}

TEST_CASE("exact_sum: a single number is its own sum, wherever it lies") {
  std::mt19937_64 random(3);
  for (const double x : spread(random, 20000, -1060, 1023)) REQUIRE(sum_of({x}) == x);
}

TEST_CASE("exact_sum: integers that a wider type holds") {
  std::mt19937_64 random(5);
  std::uniform_int_distribution<std::int64_t> integers(-(std::int64_t{1} << 52), std::int64_t{1} << 52);
  ExactSum sum;
  __int128 exact = 0;
  for (int k = 0; k < 200000; ++k) {
    const std::int64_t x = integers(random);
    exact += x;
    sum.add(static_cast<double>(x));
    if (k % 20000 == 0) CHECK(sum.value() == static_cast<double>(exact));
  }
  CHECK(sum.value() == static_cast<double>(exact));
}

TEST_CASE("exact_sum: order and who adds do not matter") {
  std::mt19937_64 random(7);
  std::vector<double> terms = spread(random, 5000, -300, 300);
  const double once = sum_of(terms);
  for (int round = 0; round < 5; ++round) {
    std::ranges::shuffle(terms, random);
    CHECK(sum_of(terms) == once);
    ExactSum parts[3], all;
    for (std::size_t k = 0; k < terms.size(); ++k) parts[k % 3].add(terms[k]);
    for (const ExactSum& part : parts) all.add(part);
    CHECK(all.value() == once);
    // As over ranks: limb by limb.
    ExactSum limbs;
    for (ExactSum& part : parts) {
      part.normalize();
      for (std::size_t k = 0; k < part.numbers().size(); ++k) limbs.numbers()[k] += part.numbers()[k];
    }
    CHECK(limbs.value() == once);
  }
  // What is added and taken away leaves nothing.
  ExactSum sum;
  for (const double x : terms) sum.add(x);
  std::ranges::shuffle(terms, random);
  for (const double x : terms) sum.add(-x);
  CHECK(sum.value() == 0.0);
}

TEST_CASE("exact_sum: a group at once is each of its terms, near to each other or far apart, subnormal or infinite") {
  std::mt19937_64 random(11);
  const auto both = [&](const std::vector<double>& terms) {
    ExactSum alone, grouped;
    for (std::size_t first = 0; first < terms.size(); first += ExactSum::group) {
      ExactSum::Group group{};
      for (std::size_t k = first; k < std::min(terms.size(), first + group.size()); ++k) alone.add(group[k - first] = terms[k]);
      grouped.add(group);
    }
    alone.normalize();
    grouped.normalize();
    CHECK(alone.numbers() == grouped.numbers());
  };
  for (const auto& [least, most] : {std::pair{-3, 3}, {-60, 60}, {-1073, -1000}, {-950, -850}, {900, 1023}, {-1073, 1023}})
    for (int round = 0; round < 200; ++round) both(spread(random, 700 + static_cast<std::size_t>(round), least, most));
  both({});
  both(std::vector<double>(600, 0.0));
  both(std::vector<double>(1024, std::numeric_limits<double>::max()));
  both(std::vector<double>(512, 0x1.fffffffffffffp-1));
  both({1.0, -INFINITY, 3.0, std::nan("")});
  both({5e-324, -1.0, 0x1p-900, 0x1p1000, -0.0});
}
