/// Surfaces of clouds that are held where they are no planes across an axis: affine fields are in equilibrium between them, and
/// manufactured solutions converge as they do between faces.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>

#include "tests/contract/integrator_fixture.hpp"
#include "tests/validation/scenes.hpp"

using namespace perikit;
using namespace perikit::validation;

namespace {

const std::vector<std::string> kinematics{"\"baqp\"", "\"projection\"", "\"bond_associated\"",
                                          "{type=\"conventional\",stabilization=\"silling\"}"};

/// Lattices whose cells the surfaces cut, and points that lie at random.
std::vector<std::string> points_of(bool jittered) {
  if (!jittered) return {};
  return {"family.partial_volume=false", "body.lattice.jitter=0.3", "body.lattice.volume=\"voronoi\""};
}

double error(const std::string& scene, int points, const std::string& law, bool jittered) {
  std::vector<std::string> overrides = points_of(jittered);
  overrides.insert(overrides.end(), {fmt::format("constants.n={}", points), "kinematics=" + law, "run.threads=1"});
  const auto simulation = load("faces/" + scene + ".toml", overrides);
  return error_of_run(*simulation);
}

}  // namespace

TEST_CASE(
    "an affine field between oblique sides and around corners is in equilibrium on clouds, and the work of the sides is the "
    "energy") {
  const std::string field = "[\"1e-6*(0.3*x + 0.7*y)\", \"1e-6*(0.2*x - 0.4*y)\"]";
  std::string sides;
  for (const char* level : {"c*x + s*y - 0.5", "-c*x - s*y - 0.5", "c*y - s*x - 0.5", "s*x - c*y - 0.5"})
    sides += fmt::format("{{surface=\"{}\",displacement={}}},", level, field);
  const std::string history =
      "[{name=\"error_x\",quantity=\"displacement\",component=\"x\",reduce=\"error\",exact=\"t*1e-6*(0.3*x + 0.7*y)\"},"
      "{name=\"error_y\",quantity=\"displacement\",component=\"y\",reduce=\"error\",exact=\"t*1e-6*(0.2*x - 0.4*y)\"}]";
  for (const std::string& law : kinematics)
    for (const bool jittered : {false, true}) {
      INFO(law, jittered ? " jittered" : " cut cells");
      std::vector<std::string> overrides = points_of(jittered);
      overrides.insert(overrides.end(), {"constants.n=12", "kinematics=" + law, "boundary=[" + sides + "]", "load=[]",
                                         "output.history=" + history, "run.threads=1"});
      const auto simulation = load("faces/oblique_square.toml", overrides);
      const double error = error_of_run(*simulation);
      CHECK_MESSAGE(error <= 1e-9, "error ", error);
      const Energies e = contract::run(*load("faces/oblique_square.toml", overrides)).energies.back();
      CHECK_MESSAGE(std::abs(e.external_work - e.strain) <= 1e-9 * e.strain, "work ", e.external_work, ", energy ", e.strain);
    }
}

TEST_CASE("order two between curved and oblique surfaces") {
  for (const char* scene : {"tube", "oblique_square"})
    for (const std::string& law : kinematics)
      for (const bool jittered : {false, true}) {
        const double coarse = error(scene, 10, law, jittered), fine = error(scene, 20, law, jittered),
                     order = std::log2(coarse / fine);
        CHECK_MESSAGE(order >= 1.8, scene, ", ", law, jittered ? " jittered" : " cut cells", ": errors ", coarse, " and ", fine,
                      ", order ", order);
      }
}
