// What holds a side of a body has the moment that balances the body: of reactions where they act, not where their points are.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>

#include "tests/kit/runs.hpp"
#include "unit/temporary_folder.hpp"

using namespace perikit;
using namespace perikit::test;

namespace {

/// Columns with the moments of reactions (`held`) and of internal forces (`inner`) of all points about two places.
std::string moments(int dimension, const std::string& set = "all") {
  std::string text = "[output]\nhistory = [\n";
  for (const char* component : {"x", "y", "z"}) {
    if (dimension == 2 && component[0] != 'z') continue;
    for (const auto& [name, quantity] : {std::pair{"held", "reaction"}, std::pair{"inner", "internal_force"}})
      for (const auto& [place, about] : {std::pair{"far", "-3, 7, 2"}, std::pair{"near", "0.1, 0.2, 0.3"}})
        text += fmt::format("{{ name = \"{}_{}_{}\", set = \"{}\", quantity = \"{}\", component = \"{}\", reduce = \"moment\", about = [{}] }},\n", name, component, place, set, quantity,
                            component, std::string(about).substr(0, dimension == 2 ? std::string(about).rfind(',') : std::string::npos));
  }
  return text + "]\n";
}

std::string body(int dimension, const std::string& further = "") {
  return dimension == 2 ? "format = 1\n[body]\ndimension = 2\nplane = \"strain\"\n[body.lattice]\nspacing = 0.1\nlower = [0, 0]\nupper = [1.2, 0.8]\n" + further
                        : "format = 1\n[body]\ndimension = 3\n[body.lattice]\nspacing = 0.2\nlower = [0, 0, 0]\nupper = [1.2, 1, 1]\n" + further;
}

/// The body starts so, and its sides are there.
std::string motion(int dimension) {
  return dimension == 2 ? "[\"0.1*x*y + 0.2*x\", \"0.3*sin(x) - 0.05*y*y\"]\n"
                        : "[\"0.1*x*y + 0.2*z\", \"0.3*sin(x) - 0.05*y*z\", \"0.1*x*z - 0.2*z\"]\n";
}

std::string model(const std::string& kinematics, int dimension) {
  return "[family]\nhorizon_ratio = 2.015\n[kinematics]\ntype = " + kinematics +
         "\n[material]\ntype = \"neo_hookean\"\nshear_modulus = 1.0\nbulk_modulus = 2.0\n[integrator]\ntype = \"evaluate\"\n[initial]\ndisplacement = " + motion(dimension);
}

std::string held(const std::string& face, int dimension) { return "[[boundary]]\nface = \"" + face + "\"\ndisplacement = " + motion(dimension); }

void check_balance(const std::string& scene, int dimension) {
  INFO(scene);
  const TemporaryFolder folder;
  const auto columns = columns_of(scene, folder.path);
  const auto last = [&](const std::string& column) { return columns.at(column).back(); };
  for (const char* component : {"x", "y", "z"})
    for (const char* place : {"near", "far"}) {
      if (dimension == 2 && component[0] != 'z') continue;
      const double inner = last(fmt::format("inner_{}_{}", component, place)), held = last(fmt::format("held_{}_{}", component, place));
      CHECK(std::abs(inner) > 1e-4);
      CHECK_MESSAGE(std::abs(held - inner) <= 1e-11 * std::abs(inner) + 1e-14, component, " ", place, ": ", held, " ", inner);
    }
}

}  // namespace

TEST_CASE("the moment of reactions at held sides balances that of internal forces, about any place and in large motion") {
  for (const char* kinematics : {"\"baqp\"", "\"bond_based\"", "\"conventional\"\nstabilization = \"silling\"", "\"projection\""}) {
    const std::string face = held("-x", 2), other = held("+y", 2);
    check_balance(body(2) + model(kinematics, 2) + face + moments(2), 2);
    check_balance(body(2) + model(kinematics, 2) + face + other + moments(2), 2);   // with images of images at the corner
    check_balance(body(2) + model(kinematics, 2) + "[[boundary]]\nface = \"-x\"\ndisplacement = [\"0.1*x*y + 0.2*x\", \"free\"]\n" + moments(2), 2);
    check_balance(body(2, "jitter = 0.2\n") + model(kinematics, 2) + face + moments(2), 2);
  }
  const std::string face = held("-x", 3), sliding = "[[boundary]]\nface = \"-z\"\ndisplacement = [\"free\", \"free\", 0]\n";
  for (const char* kinematics : {"\"baqp\"", "\"bond_based\""}) {
    check_balance(body(3) + model(kinematics, 3) + face + moments(3), 3);
    check_balance(body(3) + model(kinematics, 3) + face + sliding + moments(3), 3);
  }
}

TEST_CASE("the moment at a held face is that of the loads, about any place") {
  // A cantilever with a force on its end; both sums of the reaction and of its moment come from the face alone.
  const std::string scene = body(2) +
                            "[sets]\nleft = \"x < 0.1\"\nright = \"x > 1.1\"\n[family]\nhorizon_ratio = 2.015\n[kinematics]\ntype = \"baqp\"\n[material]\ntype = \"linear_elastic\"\n"
                            "youngs_modulus = 1.0\npoisson_ratio = 0.25\n[[boundary]]\nface = \"-x\"\ndisplacement = [0, 0]\n[[load]]\nset = \"right\"\nforce = [0, 1e-9]\n"
                            "[integrator]\ntype = \"newton\"\nsteps = 1\n" +
                            moments(2, "left") + "[[load]]\nset = \"right\"\nforce = [1e-9, 0]\n";
  const TemporaryFolder folder;
  const auto columns = columns_of(scene, folder.path);
  const double x = 1.15, y = 0.4;   // the middle of the loaded points
  CHECK(columns.at("held_z_near").back() == doctest::Approx(-1e-9 * ((x - 0.1) - (y - 0.2))).epsilon(1e-7));
  CHECK(columns.at("held_z_far").back() == doctest::Approx(-1e-9 * ((x + 3) - (y - 7))).epsilon(1e-7));
}
