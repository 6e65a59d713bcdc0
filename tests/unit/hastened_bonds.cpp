/// Bonds that weaken from round to round, by hand.

#include "fracture/aitken_acceleration.hpp"

#include <doctest/doctest.h>

#include <cmath>

using namespace perikit;

namespace {

/// One bond whose integrity tends to what `next` makes of its last one; the integrities after each round.
template <class Next>
std::vector<double> rounds(int n, Next&& next) {
  AitkenAcceleration hastened;
  std::vector<double> b{1.0};
  for (int k = 0; k < n; ++k) {
    std::vector<BondChange> changes{{BondId::of(3, 5), next(b.back())}};
    hastened.accelerate(changes, {b.back()});
    b.push_back(changes[0].integrity);
  }
  return b;
}

}  // namespace

TEST_CASE("hastened bonds: of a series half of what is to come is taken in its second round, and never too much") {
  for (const double ratio : {0.3, 0.8, 0.95}) {
    INFO("ratio ", ratio);
    const auto b = rounds(40, [&](double now) { return 0.7 + ratio * (now - 0.7); });
    CHECK(b[1] == 0.7 + ratio * (1.0 - 0.7));  // nothing is known in the first round
    CHECK(b[2] - 0.7 == doctest::Approx(0.5 * ratio * ratio * 0.3).epsilon(1e-10));
    for (std::size_t k = 1; k < b.size(); ++k) {
      CHECK(b[k] <= b[k - 1]);
      CHECK(b[k] >= 0.7 - 1e-15);
    }
    CHECK(b.back() - 0.7 < 1e-6);
  }
}

TEST_CASE("hastened bonds: two series at once stay above their end") {
  const auto end = [](int k) { return 0.5 + 0.2 * std::pow(0.9, k) + 0.3 * std::pow(0.4, k); };
  AitkenAcceleration hastened;
  for (int k = 1; k < 6; k += 2) {
    hastened.forget();
    std::vector<BondChange> first{{BondId::of(0, 1), end(k)}}, second{{BondId::of(0, 1), end(k + 1)}};
    hastened.accelerate(first, {end(k - 1)});
    CHECK(first[0].integrity == end(k));
    hastened.accelerate(second, {end(k)});
    CHECK(second[0].integrity < end(k + 1));
    CHECK(second[0].integrity > 0.5);
  }
}

TEST_CASE("hastened bonds: falls that grow are left alone, no bond fails by a forecast, and others are not touched") {
  const auto growing = rounds(5, [](double now) { return now - 0.5 * (1.1 - now); });
  for (std::size_t k = 1; k < growing.size(); ++k) CHECK(growing[k] == doctest::Approx(growing[k - 1] - 0.5 * (1.1 - growing[k - 1])));
  AitkenAcceleration hastened;
  std::vector<BondChange> first{{BondId::of(0, 1), 0.5}}, second{{BondId::of(0, 1), 0.1}, {BondId::of(1, 2), 0.4}};
  hastened.accelerate(first, {1.0});
  hastened.accelerate(second, {0.5, 0.9});
  CHECK(second[0].integrity == 0.05);  // 0.5 * 0.4 * 0.8/0.2 would be far below 0
  CHECK(second[1].integrity == 0.4);
}
