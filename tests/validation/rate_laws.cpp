/// Rate laws through whole explicit runs: simple shear against the closed form of Dienes, a twisting bar that keeps its energy.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>

#include "tests/contract/integrator_fixture.hpp"
#include "tests/validation/scenes.hpp"

using namespace perikit;
using namespace perikit::validation;

namespace {

struct Dienes {
  double xx, xy;
};
Dienes shear_stress(double shear) {
  const double b = std::atan(shear / 2), c = std::cos(b), s = std::sin(b);
  return {4 * (std::cos(2 * b) * std::log(c) + b * std::sin(2 * b) - s * s),
          2 * std::cos(2 * b) * (2 * b - 2 * std::tan(2 * b) * std::log(c) - std::tan(b))};
}

}  // namespace

TEST_CASE("simple shear of a rate law: stress and work of the closed form, under every kinematics with gradients") {
  const Dienes expected = shear_stress(4.0);
  CHECK(expected.xy == doctest::Approx(2.317944).epsilon(1e-6));
  CHECK(expected.xx == doctest::Approx(2.274201).epsilon(1e-6));
  double work = 0;  // integral of sigma_xy over the shear, by Simpson's rule
  constexpr int parts = 1000;
  for (int k = 0; k <= parts; ++k)
    work += (k == 0 || k == parts ? 1 : k % 2 == 1 ? 4 : 2) * shear_stress(4.0 * k / parts).xy * 4.0 / parts / 3;
  const auto run = [&](std::vector<std::string> overrides) {
    const auto simulation = load("partmann/rate_shear.toml", std::move(overrides));
    contract::run(*simulation);
    BodyProblem& problem = simulation->problem();
    PointSamples samples;
    REQUIRE(problem.terms().sample({problem.state().displacement(), 0}, samples).ok());
    double worst = 0;
    for (const std::int32_t p : problem.body().internal()) {
      worst = std::max({worst, std::abs(samples.cauchy.component(0)[p] - expected.xx),
                        std::abs(samples.cauchy.component(4)[p] + expected.xx),
                        std::abs(samples.cauchy.component(1)[p] - expected.xy), std::abs(samples.cauchy.component(8)[p]),
                        std::abs(samples.strain_energy_density.data()[p] - work)});
    }
    return worst;
  };
  for (const char* kinematics :
       {"{ type = \"conventional\" }", "{ type = \"baqp\" }", "{ type = \"bond_associated\" }", "{ type = \"sub_horizon\" }",
        "{ type = \"selective\", base = { type = \"bond_associated\" } }", "{ type = \"selective\", base = \"baqp\" }"})
    for (const char* jitter : {"0", "0.2"}) {
      const double error = run(
          {fmt::format("kinematics={}", kinematics), fmt::format("body.lattice.jitter={}", jitter), "integrator.time_step=0.01"});
      CHECK_MESSAGE(error <= 1e-3, kinematics, ", jitter ", jitter, ": off by ", error);
    }
  const double coarse = run({"integrator.time_step=0.005"}), fine = run({});
  CHECK(fine <= 1e-4);
  CHECK(coarse / fine == doctest::Approx(4).epsilon(0.05));
}

TEST_CASE("twisting bar of a rate law: large rotations keep the energy") {
  const auto simulation = load("partmann/twisting_bar.toml", {"material.type=hypoelastic", "constants.dx=0.02",
                                                              "body.lattice.spacing=0.02", "integrator.end_time=0.01"});
  const contract::Watch watch = contract::run(*simulation);
  const double total = watch.energies.front().kinetic;
  double strain = 0;
  for (const Energies& energies : watch.energies) strain = std::max(strain, energies.strain);
  CHECK(strain > 0.3 * total);
  CHECK_MESSAGE(watch.imbalance() <= 1e-3 * total, watch.imbalance(), " of ", total);
}
