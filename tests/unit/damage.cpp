/// Constants of the damage criteria, by hand.

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "perikit/model/damage.hpp"
#include "perikit/plugin/registry.hpp"
#include "perikit/scene/scene.hpp"

using namespace perikit;

namespace {

std::unique_ptr<Damage> make(const std::string& type, const std::string& table) {
  static Registry registry;
  if (registry.names(Kind::damage).empty()) registry.add_folder(PERIKIT_PLUGIN_FOLDER);
  return registry.damage(*parse_part(Kind::damage, type, table, registry));
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
