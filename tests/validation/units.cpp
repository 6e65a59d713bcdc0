/// A body has no unit of its own: lengths, moduli and densities times any numbers give displacements in proportion to the lengths and energies in proportion to
/// modulus times volume, while bonds fail, too.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>

#include "tests/contract/integrator_fixture.hpp"
#include "tests/kit/messages.hpp"
#include "tests/validation/scenes.hpp"

using namespace perikit;
using namespace perikit::validation;

namespace {

struct Units {
  double length, modulus, density;
};
// Millimetres, newtons and tonnes; then what keeps moduli and lengths within the numbers that are allowed for them.
const std::vector<Units> all_units{{1e3, 1e-6, 1e-12}, {1, 1e-95, 1}, {1, 1e95, 1e-20}, {1e-28, 1e-60, 1}, {1e20, 1e-60, 1}, {1e28, 1, 1e-30}};

std::string scene(const std::string& kinematics, const std::string& integrator, bool cloud, const Units& units) {
  const double L = units.length, T = L * std::sqrt(units.density / units.modulus);
  const bool dynamic = integrator == "verlet";
  std::string text = fmt::format(
      "format = 1\n[body]\ndimension = 2\nplane = \"strain\"\n[body.lattice]\nspacing = {:.17g}\nlower = [0, 0]\nupper = [{:.17g}, {:.17g}]\njitter = {}\n[sets]\n"
      "low = \"x < {:.17g}\"\nhigh = \"x > {:.17g}\"\n[family]\nhorizon_ratio = 2.015\n[kinematics]\n{}\n[material]\ntype = \"linear_elastic\"\ndensity = {:.17g}\n"
      "youngs_modulus = {:.17g}\npoisson_ratio = 0.25\n[[boundary]]\nset = \"low\"\ndisplacement = [0, 0]\n[[boundary]]\nset = \"high\"\n",
      0.1 * L, 1.2 * L, 0.8 * L, cloud ? 0.1 : 0.0, 0.2 * L, L, kinematics, units.density, units.modulus);
  if (!dynamic) return text + fmt::format("displacement = [{:.17g}, 0]\n[integrator]\ntype = \"{}\"\nsteps = 2\n", 0.02 * L, integrator);
  return text + fmt::format(
                    "velocity = [{:.17g}, 0]\n[damage]\ntype = \"critical_energy\"\nenergy_release_rate = {:.17g}\nno_fail = [\"low\", \"high\"]\n[[crack]]\n"
                    "segment = [[{:.17g}, {:.17g}], [{:.17g}, {:.17g}]]\n[integrator]\ntype = \"verlet\"\nend_time = {:.17g}\n",
                    0.025 * L / T, 1e-3 * units.modulus * L, 0.6 * L, -L, 0.6 * L, 0.31 * L, 2 * T);
}

struct Outcome {
  std::vector<double> displacement;
  double strain = 0, dissipated = 0;
  std::int64_t steps = 0;
};

/// In the units of the scene.
Outcome outcome(const std::string& kinematics, const std::string& integrator, bool cloud, const Units& units) {
  const auto simulation = build(scene(kinematics, integrator, cloud, units));
  const contract::Watch watch = contract::run(*simulation);
  const double energy = units.modulus * units.length * units.length;
  Outcome found{contract::displacement(*simulation), watch.energies.back().strain / energy, watch.energies.back().dissipated / energy, watch.reports.back().step};
  for (double& u : found.displacement) u /= units.length;
  return found;
}

}  // namespace

TEST_CASE("units: results scale with lengths, moduli and densities, with every integrator, while bonds fail") {
  const std::vector<std::string> kinematics{"type = \"ordinary\"", "type = \"baqp\"", "type = \"bond_associated\"",
                                            "type = \"conventional\"\nstabilization = \"wan\""};
  for (const std::string& of : kinematics)
    for (const std::string integrator : {"newton", "dynamic_relaxation", "verlet"}) {
      const bool cloud = integrator == "verlet";
      const Outcome one = outcome(of, integrator, cloud, {1, 1, 1});
      if (cloud) CHECK(one.dissipated > 0);
      for (const Units& units : all_units) {
        INFO(fmt::format("{}, {}, {} m, {} Pa, {} kg/m^3", of, integrator, units.length, units.modulus, units.density));
        const Outcome other = outcome(of, integrator, cloud, units);
        CHECK(other.steps == one.steps);
        CHECK(contract::difference(other.displacement, one.displacement) < 1e-6 * contract::largest(one.displacement));
        CHECK(other.strain == doctest::Approx(one.strain).epsilon(1e-6));
        CHECK(other.dissipated == doctest::Approx(one.dissipated).epsilon(1e-6));
      }
    }
}

TEST_CASE("units: lengths whose shape tensors are no numbers are refused") {
  for (const double length : {1e-31, 1e32}) {
    const std::string message = test::message_of([&] { build(scene("type = \"baqp\"", "newton", false, {length, 1, 1})); });
    CHECK_MESSAGE(message.find("body.lattice.spacing: found points") != std::string::npos, message);
    CHECK_MESSAGE(message.find("allowed: 1e-30 to 1e+30 m") != std::string::npos, message);
  }
}
