/// Cook's membrane of Scabbia et al., section 4.4, nearly incompressible: the selective map does not lock.

#include <doctest/doctest.h>

#include <cmath>

#include "tests/validation/quasi_static.hpp"

using namespace perikit;
using namespace perikit::validation;

namespace {

/// Vertical displacement of the corner at L/20.
double corner(const std::string& kinematics) {
  const auto simulation = load("scabbia/cook.toml", {"body.lattice.spacing=2.2", "constants.h=2.2", "kinematics=" + kinematics});
  const Protocol protocol = run(*simulation);
  CHECK(protocol.reports.back().time == 1.0);
  CHECK(protocol.reports.back().residual <= 1e-9);
  return mean(*simulation, "tip", 1);
}

}  // namespace

TEST_CASE("Cook's membrane: selective comes within 7 % on the coarsest lattice, its base alone locks") {
  constexpr double reference = 6.941;   // mixed finite elements
  for (const char* base : {"bond_associated", "baqp", "projection"}) {
    INFO(base);
    const double found = corner("{ type = \"selective\", base = { type = \"" + std::string(base) + "\" } }");
    CHECK_MESSAGE(std::abs(found / reference - 1) < 0.07, "corner ", found);
  }
  const double locked = corner("{ type = \"bond_associated\" }");
  CHECK_MESSAGE(locked < 0.45 * reference, "corner ", locked);
}
