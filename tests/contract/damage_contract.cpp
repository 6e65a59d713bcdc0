/// What every damage criterion must fulfil: integrity 1 up to the onset and 0 beyond failure, never rising with the stretch, the
/// same for one bond as for many, limits that do not depend on the units, and a value that is made of nothing but what was asked
/// for.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "perikit/core/field.hpp"
#include "perikit/model/damage.hpp"
#include "tests/contract/fixture.hpp"

using namespace perikit;
using namespace perikit::contract;

namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr double poison = std::numeric_limits<double>::quiet_NaN();
constexpr Space spaces[] = {Space::line_strain, Space::line_stress, Space::plane_strain, Space::plane_stress, Space::solid};

std::unique_ptr<Damage> criterion_of(const Example& example) {
  return subject().registry.damage(*parse_part(Kind::damage, example.part, example.table, subject().registry));
}

/// A point in units of `length` [m] and `pressure` [Pa].
DamagePoint point(Space space, double length, double pressure) {
  const double crossing = std::pow(length, dimension(space) + 1);
  return {{space, 1.0, 3 * length, {1.2 * pressure, 0.8 * pressure}}, 2.1 * length, 60 * crossing, 40 * crossing};
}

std::vector<double> integrities(const Damage& damage, const std::vector<double>& stretch, const DamageLimits& limits) {
  const std::size_t size = padded(stretch.size());
  AlignedVector<double> s(size, 0.0), onset(size, limits.onset), failure(size, limits.failure), b(size, poison);
  std::copy(stretch.begin(), stretch.end(), s.begin());
  damage.integrity({static_cast<int>(stretch.size()), s.data(), onset.data(), failure.data(), b.data()});
  return {b.begin(), b.begin() + static_cast<std::ptrdiff_t>(stretch.size())};
}

/// From strong compression to far beyond failure, both limits and their neighbours among them.
std::vector<double> stretches(const DamageLimits& limits) {
  std::vector<double> s{-1.0,
                        -0.5,
                        0.0,
                        limits.onset,
                        std::nextafter(limits.onset, infinite),
                        limits.failure,
                        std::nextafter(limits.failure, infinite),
                        10 * limits.failure,
                        1e6};
  for (int k = 0; k <= 100; ++k) s.push_back(limits.onset * 0.9 + (1.1 * limits.failure - 0.9 * limits.onset) * k / 100.0);
  std::sort(s.begin(), s.end());
  return s;
}

}  // namespace

TEST_CASE("damage: limits are positive, ordered, finite and repeatable") {
  for (const Example& example : examples(Kind::damage))
    for (const Space space : spaces) {
      INFO(example.part, " (", example.table, ")");
      const auto damage = criterion_of(example);
      const DamageLimits limits = damage->limits(point(space, 1.0, 1.0)), again = damage->limits(point(space, 1.0, 1.0));
      CHECK(limits.onset > 0);
      CHECK(limits.onset <= limits.failure);
      CHECK(std::isfinite(limits.failure));
      CHECK(limits.onset == again.onset);
      CHECK(limits.failure == again.failure);
    }
}

TEST_CASE("damage: limits are numbers of the value's unit, the same body in any system of units") {
  for (const Example& example : examples(Kind::damage))
    for (const Space space : spaces) {
      INFO(example.part, " (", example.table, ")");
      const auto damage = criterion_of(example);
      // energy_release_rate is J/m^2 = Pa m: with lengths in mm and pressures in Pa 1000 smaller numbers stand for the same body.
      // Energies of bonds are those of a body of thickness or area 1; a strength is a number of its own.
      const double unit = damage->traits().energy ? std::pow(1e3, -dimension(space) - 1) : 1.0;
      const DamageLimits one = damage->limits(point(space, 1.0, 1.0)), other = damage->limits(point(space, 1e3, 1e-3));
      CHECK(other.onset == doctest::Approx(unit * one.onset).epsilon(1e-13));
      CHECK(other.failure == doctest::Approx(unit * one.failure).epsilon(1e-13));
    }
}

namespace {

/// Bonds of all kinds, at rest, in compression and in extension among them.
struct Bonds {
  static constexpr std::size_t n = 37, stride = 48;
  AlignedVector<double> length, stretch, share, energy, stress, value;

  Bonds() {
    for (auto* array : {&length, &stretch, &share, &energy, &value}) array->assign(stride, poison);
    stress.assign(6 * stride, poison);
    std::uint64_t seed = 3;
    const auto random = [&] {
      return static_cast<double>((seed = seed * 6364136223846793005u + 1442695040888963407u) >> 11) * 0x1p-53;
    };
    for (std::size_t k = 0; k < n; ++k) {
      length[k] = 0.5 + random();
      share[k] = 0.1 + random();
      stretch[k] = k == 0 ? 0.0 : 0.2 * random() - 0.05;
      energy[k] = k == 0 ? 0.0 : 0.01 * random();
      for (std::size_t c = 0; c < 6; ++c) stress[c * stride + k] = k == 0 ? 0.0 : random() - 0.4;
    }
  }
  /// Bond k alone, or all; null where the traits do not ask.
  std::vector<double> values(const Damage& damage, std::size_t first, std::size_t count) {
    const DamageTraits traits = damage.traits();
    std::fill(value.begin(), value.end(), poison);
    AlignedVector<double> arrays[5], tensors(6 * stride, poison);
    const AlignedVector<double>* from[] = {&length, &stretch, &share, &energy};
    for (int a = 0; a < 4; ++a) {
      arrays[a].assign(stride, poison);
      std::copy_n(from[a]->begin() + static_cast<std::ptrdiff_t>(first), count, arrays[a].begin());
    }
    for (std::size_t c = 0; c < 6; ++c)
      std::copy_n(stress.begin() + static_cast<std::ptrdiff_t>(c * stride + first), count,
                  tensors.begin() + static_cast<std::ptrdiff_t>(c * stride));
    damage.measure({static_cast<int>(count), arrays[0].data(), arrays[1].data(), arrays[2].data(),
                    traits.energy ? arrays[3].data() : nullptr, traits.stress ? tensors.data() : nullptr, stride, value.data()});
    return {value.begin(), value.begin() + static_cast<std::ptrdiff_t>(count)};
  }
};

}  // namespace

TEST_CASE("damage: the value of a bond is finite, 0 at rest, below its bound, and bitwise the same for one bond and for many") {
  for (const Example& example : examples(Kind::damage)) {
    const auto damage = criterion_of(example);
    const DamageTraits traits = damage->traits();
    if (!traits.energy && !traits.stress) continue;
    INFO(example.part, " (", example.table, ")");
    Bonds bonds;
    const std::vector<double> all = bonds.values(*damage, 0, Bonds::n);
    CHECK(all[0] == 0);
    CHECK(*std::max_element(all.begin(), all.end()) > 0);
    for (std::size_t k = 0; k < Bonds::n; ++k) {
      CHECK(std::isfinite(all[k]));
      CHECK_MESSAGE(bonds.values(*damage, k, 1)[0] == all[k], "bond ", k, " has another value alone");
      if (traits.bound != ValueBound::none)
        CHECK(all[k] <= (1 + 1e-13) * bonds.energy[k] / (traits.bound == ValueBound::energy ? 1.0 : bonds.share[k]));
    }
  }
}

TEST_CASE("damage: 1 up to the onset, 0 beyond failure, never rising, bits where declared") {
  for (const Example& example : examples(Kind::damage)) {
    INFO(example.part, " (", example.table, ")");
    const auto damage = criterion_of(example);
    const DamageLimits limits = damage->limits(point(Space::solid, 1.0, 1.0));
    const std::vector<double> s = stretches(limits), b = integrities(*damage, s, limits);
    bool broken = false;
    for (std::size_t k = 0; k < s.size(); ++k) {
      CHECK_MESSAGE((b[k] >= 0 && b[k] <= 1), "b(", s[k], ") = ", b[k]);
      if (s[k] <= limits.onset) CHECK_MESSAGE(b[k] == 1, "b(", s[k], ") = ", b[k]);
      if (s[k] > limits.failure) CHECK_MESSAGE(b[k] == 0, "b(", s[k], ") = ", b[k]);
      if (k > 0) CHECK_MESSAGE(b[k] <= b[k - 1], "rises at s = ", s[k]);
      if (damage->traits().bits) CHECK((b[k] == 0 || b[k] == 1));
      broken = broken || b[k] == 0;
    }
    CHECK(broken);
    // Points that must not fail: an infinite limit at one end makes the bond's limits infinite.
    for (const double value : integrities(*damage, s, {infinite, infinite})) CHECK(value == 1);
  }
}

TEST_CASE("damage: bitwise the same for one bond and for many, and writes its own output only") {
  for (const Example& example : examples(Kind::damage)) {
    INFO(example.part, " (", example.table, ")");
    const auto damage = criterion_of(example);
    const DamageLimits limits = damage->limits(point(Space::solid, 1.0, 1.0));
    const std::vector<double> s = stretches(limits), b = integrities(*damage, s, limits);
    for (std::size_t k = 0; k < s.size(); ++k)
      CHECK_MESSAGE(integrities(*damage, {s[k]}, limits)[0] == b[k], "batch and single differ at s = ", s[k]);
    AlignedVector<double> value(16, limits.onset / 2), onset(16, limits.onset), failure(16, limits.failure), out(32, -3.0);
    damage->integrity({5, value.data(), onset.data(), failure.data(), out.data() + 8});
    CHECK(std::all_of(out.begin(), out.begin() + 8, [](double v) { return v == -3.0; }));
    CHECK(std::all_of(out.begin() + 16, out.end(), [](double v) { return v == -3.0; }));
    CHECK(std::all_of(out.begin() + 8, out.begin() + 13, [](double v) { return v == 1.0; }));
  }
}
