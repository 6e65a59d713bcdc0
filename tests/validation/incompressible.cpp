/// Nearly incompressible rubber of Scabbia et al., sections 4.2 to 4.4: the selective map does not lock, whatever its base.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tests/validation/quasi_static.hpp"

using namespace perikit;
using namespace perikit::validation;

namespace {

std::string selective(const std::string& base) { return "kinematics={ type = \"selective\", base = { type = \"" + base + "\" } }"; }
std::string alone(const std::string& kinematics) { return "kinematics={ type = \"" + kinematics + "\" }"; }

/// Axial force over mu w of the clamped square.
double square_force(const std::string& kinematics) {
  const auto simulation = load("scabbia/square.toml", {kinematics, "constants.n=14"});
  CHECK(run(*simulation).reports.back().residual <= 1e-9);
  return -pull(*simulation, "left", 0);
}

/// Displacement of the upper face of the crack, from its mouth to its tip.
std::vector<double> opening(const std::string& kinematics, const std::string& influence) {
  const auto simulation = load("scabbia/crack_tip.toml", {kinematics, "constants.n=12", "family.influence=\"" + influence + "\""});
  CHECK(run(*simulation).reports.back().residual <= 1e-9);
  BodyProblem& problem = simulation->problem();
  std::vector<double> profile;
  for (const std::int32_t p : problem.body().internal()) {
    const Point x = problem.body().position(static_cast<std::size_t>(p));
    if (x[0] < 1 && x[1] > 0 && x[1] < 1.0 / 12) profile.push_back(problem.displacement().component(1)[p]);
  }
  return profile;
}

/// Root mean square of the difference of the openings with two influence functions, over the largest opening.
double difference(const std::string& kinematics) {
  const std::vector<double> a = opening(kinematics, "gaussian"), b = opening(kinematics, "constant");
  REQUIRE(a.size() == 12);
  REQUIRE(b.size() == 12);
  double sum = 0;
  for (std::size_t k = 0; k < a.size(); ++k) sum += (a[k] - b[k]) * (a[k] - b[k]);
  return std::sqrt(sum / static_cast<double>(a.size())) / *std::max_element(a.begin(), a.end());
}

}  // namespace

TEST_CASE("clamped square: selective gives the force, its bases alone lock") {
  constexpr double reference = 1.067;   // mixed finite elements
  for (const char* base : {"bond_associated", "baqp"}) {
    INFO(base);
    const double force = square_force(selective(base)), locked = square_force(alone(base));
    CHECK_MESSAGE(std::abs(force / reference - 1) < 0.02, "force ", force);
    CHECK_MESSAGE(locked > 1.3 * reference, "force of the base alone ", locked);
  }
}

TEST_CASE("crack tip: with selective the opening does not depend on the influence function") {
  const double map = difference(selective("bond_associated")), base = difference(alone("bond_associated"));
  CHECK_MESSAGE(map < 0.01, "selective ", map);
  CHECK_MESSAGE(base > 4 * map, "bond_associated ", base);
}

TEST_CASE("arch: the tip follows the elastica to the end of the curve") {
  const auto simulation = load("scabbia/arch.toml");
  CHECK(run(*simulation).reports.back().residual <= 1e-9);
  CHECK(std::abs(mean(*simulation, "end", 0) / -2.072 - 1) < 0.06);
  CHECK(std::abs(mean(*simulation, "end", 1) / -9.768 - 1) < 0.04);
}
