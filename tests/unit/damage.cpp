/// Constants of the damage criteria, by hand.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <numbers>

#include "perikit/model/damage.hpp"
#include "scene/scene.hpp"
#include "tests/kit/registry.hpp"

using namespace perikit;
using namespace perikit::test;

namespace {

std::unique_ptr<Damage> make(const std::string& type, const std::string& table) {
  return all_parts().damage(*parse_part(Kind::damage, type, table, all_parts()));
}

}  // namespace

TEST_CASE("critical_stretch from the energy release rate") {
  const Moduli m{2.0, 1.5};
  const double Gc = 0.03, delta = 0.4, pi = std::numbers::pi;
  const auto classic = make("critical_stretch", "energy_release_rate = 0.03");
  const auto at = [&](const Damage& damage, Space space, double mean_length) { return damage.limits({{space, 1.0, delta, m}, mean_length}).failure; };
  CHECK(at(*classic, Space::solid, 0.1) == doctest::Approx(std::sqrt(5 * Gc / (9 * m.bulk() * delta))).epsilon(1e-14));
  CHECK(at(*classic, Space::plane_strain, 0.1) == doctest::Approx(std::sqrt(pi * Gc / (3 * (m.bulk() + m.mu / 3) * delta))).epsilon(1e-14));
  CHECK(at(*classic, Space::plane_stress, 0.1) == doctest::Approx(std::sqrt(pi * Gc / (3 * m.youngs() / (2 * (1 - m.poisson())) * delta))).epsilon(1e-14));
  CHECK(at(*classic, Space::line_stress, 0.1) == doctest::Approx(std::sqrt(3 * Gc / (m.youngs() * delta))).epsilon(1e-14));
  // Counted bonds take the place of either integral: of 2D 2 psi <xi>/pi = Gc, psi = k (2 s)^2/2.
  DamagePoint counted{{Space::plane_strain, 1.0, delta, m}, 0.4};
  counted.counted_length = 0.7;
  for (const char* const further : {"", "\nconsistent = true"}) {
    const double s = make("critical_stretch", std::string("energy_release_rate = 0.03") + further)->limits(counted).failure;
    CHECK(2 * (counted.bulk() * 4 * s * s / 2) * 0.7 / std::numbers::pi == doctest::Approx(0.03).epsilon(1e-12));
  }
  // The consistent form asks for <xi> alone; with that of omega = xi it is the classic one.
  const auto consistent = make("critical_stretch", "energy_release_rate = 0.03\nconsistent = true");
  CHECK(at(*consistent, Space::solid, 0.3) == doctest::Approx(std::sqrt(4 * Gc / (9 * m.bulk() * 0.3))).epsilon(1e-14));
  CHECK(at(*consistent, Space::plane_strain, 0.3) == doctest::Approx(std::sqrt(pi * Gc / (4 * (m.bulk() + m.mu / 3) * 0.3))).epsilon(1e-14));
  CHECK(at(*consistent, Space::line_stress, 2 * delta / 3) == doctest::Approx(at(*classic, Space::line_stress, 0)).epsilon(1e-14));
  CHECK(make("critical_stretch", "stretch = 0.02")->limits({}).failure == 0.02);
  CHECK_THROWS_WITH_AS(make("critical_stretch", "stretch = 0.02\nconsistent = true"), doctest::Contains("only with energy_release_rate"), InputError);
}

TEST_CASE("smooth_degradation is continuous at both ends and one half in the middle") {
  const auto damage = make("smooth_degradation", "stretch_min = 0.1\nstretch = 0.3");
  alignas(64) double s[8] = {0.1 + 1e-9, 0.2, 0.3 - 1e-9, 0.15, 0.25}, onset[8], failure[8], b[8];
  std::fill_n(onset, 8, 0.1);
  std::fill_n(failure, 8, 0.3);
  damage->integrity({5, s, onset, failure, b});
  CHECK(b[0] == doctest::Approx(1).epsilon(1e-7));
  CHECK(b[1] == doctest::Approx(0.5).epsilon(1e-12));
  CHECK(std::abs(b[2]) < 1e-7);
  CHECK(b[3] + b[4] == doctest::Approx(1).epsilon(1e-12));
  // H 48, scaled: n = -1.5 at a quarter of the range.
  CHECK(b[3] == doctest::Approx((std::tanh(3.0) + std::tanh(1.5)) / (2 * std::tanh(3.0))).epsilon(1e-12));
  CHECK_THROWS_WITH_AS(make("smooth_degradation", "stretch_min = 0.3\nstretch = 0.3"),
                       doctest::Contains("found 0.3; allowed: below stretch = 0.3"), InputError);
}

TEST_CASE("critical_energy: the bonds that cross a unit of area hold the energy release rate") {
  DamagePoint x{{Space::solid, 1.0, 0.4, {2.0, 1.5}}, 0.3};
  x.crossing = 5.0;
  x.crossing_shares = 2.0;
  const auto shared = make("critical_energy", "energy_release_rate = 0.03"),
             equal = make("critical_energy", "energy_release_rate = 0.03\nlimit = \"equal\"");
  CHECK(shared->limits(x).failure == doctest::Approx(0.015).epsilon(1e-14));
  CHECK(equal->limits(x).failure == doctest::Approx(0.006).epsilon(1e-14));
  alignas(64) double length[8] = {1, 1}, s[8] = {0.1, -0.1}, share[8] = {0.5, 0.5}, energy[8] = {0.01, 0.01}, value[8];
  shared->measure({2, length, s, share, energy, nullptr, 8, value});
  CHECK(value[0] == 0.02);
  CHECK(value[1] == 0);  // shorter than at rest
  equal->measure({2, length, s, share, energy, nullptr, 8, value});
  CHECK(value[0] == 0.01);
  x.crossing_shares = 0;
  CHECK_THROWS_WITH_AS(shared->limits(x), doctest::Contains("allowed: one that gives a finite energy > 0"), std::domain_error);
}

TEST_CASE("critical_energy: bonds that weaken take up the same energy, and their force falls in a straight line") {
  DamagePoint x{{Space::solid, 1.0, 0.4, {2.0, 1.5}}, 0.3};
  x.crossing = 5.0;
  x.crossing_shares = 2.0;
  const double limit = 0.015;
  for (const double softening : {1.5, 4.0, 25.0}) {
    INFO("softening ", softening);
    const auto damage = make("critical_energy", fmt::format("energy_release_rate = 0.03\nsoftening = {}", softening));
    CHECK(!damage->traits().bits);
    const DamageLimits limits = damage->limits(x);
    CHECK(limits.onset == doctest::Approx(limit / softening).epsilon(1e-14));
    CHECK(limits.failure == doctest::Approx(limit * softening).epsilon(1e-14));
    const auto left = [&](double w) {
      alignas(64) double value[8] = {w}, onset[8] = {limits.onset}, failure[8] = {limits.failure}, b[8];
      damage->integrity({1, value, onset, failure, b});
      return b[0];
    };
    const double first = std::sqrt(limits.onset), last = std::sqrt(limits.failure);
    for (const double share : {0.25, 0.5, 0.75}) {
      const double q = first + share * (last - first);
      CHECK(q * left(q * q) == doctest::Approx((1 - share) * first).epsilon(1e-13));
    }
    // int q^2 (-db), the midpoint rule.
    constexpr int n = 20000;
    double taken = 0;
    for (int k = 0; k < n; ++k) {
      const double q = first + (last - first) * k / n, next = first + (last - first) * (k + 1) / n, mid = 0.5 * (q + next);
      taken += mid * mid * (left(q * q) - left(next * next));
    }
    CHECK(taken == doctest::Approx(limit).epsilon(1e-6));
  }
  CHECK(make("critical_energy", "energy_release_rate = 0.03")->traits().bits);
}

TEST_CASE("max_stress: the largest principal stress of bonds in extension") {
  const auto damage = make("max_stress", "strength = 2.0");
  CHECK(damage->limits({}).failure == 2.0);
  // Uniaxial, hydrostatic, simple shear; and diag(1, 2, 3) turned about (1, 1, 0).
  alignas(64) double stress[48] = {}, s[8] = {0.1, 0.1, 0.1, 0.1, -0.1}, value[8];
  const double a = std::sqrt(0.5), R[3][3] = {{0.75, 0.25, a * std::sin(std::numbers::pi / 3)},
                                              {0.25, 0.75, -a * std::sin(std::numbers::pi / 3)},
                                              {-a * std::sin(std::numbers::pi / 3), a * std::sin(std::numbers::pi / 3), 0.5}};
  double turned[3][3] = {};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k) turned[i][j] += (k + 1.0) * R[i][k] * R[j][k];
  const double bonds[5][6] = {{3, 0, 0, 0, 0, 0},
                              {-1, -1, -1, 0, 0, 0},
                              {0, 0, 0, 0.7, 0, 0},
                              {turned[0][0], turned[1][1], turned[2][2], turned[0][1], turned[0][2], turned[1][2]},
                              {3, 0, 0, 0, 0, 0}};
  for (std::size_t k = 0; k < 5; ++k)
    for (std::size_t c = 0; c < 6; ++c) stress[8 * c + k] = bonds[k][c];
  damage->measure({5, nullptr, s, nullptr, nullptr, stress, 8, value});
  const double expected[] = {3, -1, 0.7, 3, 0};
  for (int k = 0; k < 5; ++k) CHECK(value[k] == doctest::Approx(expected[k]).epsilon(1e-13));
}

TEST_CASE("[[interface]]: the criterion of [damage] with other numbers") {
  const auto scene = [](const std::string& damage) {
    return parse_scene(
        "format = 1\n[body]\ndimension = 2\nplane = \"stress\"\n[body.lattice]\nspacing = 0.1\nlower = [0, 0]\nupper = [1, 1]\n"
        "[sets]\nleft = \"x < 0.5\"\n[family]\nhorizon_ratio = 3\n[kinematics]\ntype = \"baqp\"\n"
        "[material]\ntype = \"linear_elastic\"\nyoungs_modulus = 1.0\npoisson_ratio = 0.3\n"
        "[[region]]\nset = \"left\"\nmaterial = { type = \"linear_elastic\", youngs_modulus = 2.0, poisson_ratio = 0.3 }\n"
        "[damage]\ntype = \"critical_energy\"\nenergy_release_rate = 1.0\n[integrator]\ntype = \"newton\"\n"
        "[[interface]]\nbetween = [\"rest\", \"left\"]\ndamage = " +
            damage + "\n",
        "scene.toml", all_parts());
  };
  const Scene read = scene("{ type = \"critical_energy\", energy_release_rate = 0.5 }");
  REQUIRE(read.interfaces.size() == 1);
  CHECK(read.interfaces[0].between == std::array<std::string, 2>{"rest", "left"});
  CHECK(read.interfaces[0].damage->values.number("energy_release_rate") == 0.5);
  const auto refused = [&](const std::string& damage, const char* reason) {
    CHECK_THROWS_WITH_AS(scene(damage), doctest::Contains(reason), InputErrors);
  };
  refused("{ type = \"max_stress\", strength = 1.0 }",
          "interface.0.damage: found \"max_stress\"; allowed: the criterion of [damage], \"critical_energy\"");
  refused("{ type = \"critical_energy\", energy_release_rate = 0.5, limit = \"equal\" }",
          "interface.0.damage.limit: found another value than in [damage]");
}

TEST_CASE("[damage] second_law: its default follows from the kinematics and its stabilization, and the resolved scene shows it") {
  const auto resolved = [](const std::string& kinematics, const std::string& key = {}) {
    return parse_scene("format = 1\n[body]\ndimension = 2\nplane = \"stress\"\n[body.lattice]\nspacing = 0.1\nlower = [0, 0]\nupper = [1, 1]\n"
                       "[family]\nhorizon_ratio = 3\n[kinematics]\n" + kinematics + "\n"
                       "[material]\ntype = \"linear_elastic\"\nyoungs_modulus = 1.0\npoisson_ratio = 0.3\n"
                       "[damage]\ntype = \"max_stress\"\nstrength = 1.0\n" + key + "[integrator]\ntype = \"newton\"\n",
                       "scene.toml", all_parts())
        .resolved;
  };
  const auto says = [](const std::string& text, const char* value) { return text.find(std::string("\nsecond_law = ") + value + "\n") != std::string::npos; };
  for (const char* const kinematics : {"type = \"conventional\"", "type = \"bond_augmented\"", "type = \"sub_horizon\"", "type = \"selective\"\nbase = { type = \"non_spherical\" }"}) {
    INFO(kinematics);
    CHECK(says(resolved(kinematics), "true"));
    CHECK(says(resolved(kinematics, "second_law = false\n"), "false"));
  }
  for (const char* const kinematics : {"type = \"conventional\"\nstabilization = \"silling\"", "type = \"conventional\"\nstabilization = \"wan\"", "type = \"baqp\"",
                                       "type = \"bond_based\"", "type = \"non_spherical\""}) {
    INFO(kinematics);
    CHECK(says(resolved(kinematics), "false"));
    CHECK(says(resolved(kinematics, "second_law = true\n"), "true"));
  }
}
