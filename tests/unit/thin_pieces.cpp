// Bodies that are one point thick have no gradient across: they are refused, and what is thick somewhere is not.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <fstream>

#include "tests/kit/messages.hpp"
#include "tests/kit/registry.hpp"
#include "tests/kit/scene_text.hpp"
#include "unit/temporary_folder.hpp"

using namespace perikit;
using namespace perikit::test;

namespace {

std::string scene_of(int dimension, const std::string& body, const std::string& kinematics = "baqp", const std::string& further = "") {
  return SceneText{.dimension = dimension, .space = "stress", .body = body, .kinematics = kinematics, .material = "type = \"linear_elastic\"\nyoungs_modulus = 1.0\npoisson_ratio = 0.25",
                   .further = further};
}

/// What is said against a body; empty: nothing.
std::string refusal(int dimension, const std::string& body, const std::string& kinematics = "baqp", const std::string& further = "") {
  return message_of<InputError>([&] { simulation_of(scene_of(dimension, body, kinematics, further), "thin.toml"); });
}

std::string lattice(const std::string& upper, const std::string& further = "") {
  return fmt::format("[body.lattice]\nspacing = 1.0\nlower = [0, 0{}]\nupper = [{}]\n{}", std::count(upper.begin(), upper.end(), ',') == 2 ? ", 0" : "", upper, further);
}

constexpr const char* of_all_kinds[] = {"type = \"baqp\"", "type = \"projection\"", "type = \"conventional\"\nstabilization = \"silling\"", "type = \"sub_horizon\"",
                                        "type = \"non_spherical\"", "type = \"selective\"\nbase = { type = \"baqp\" }", "type = \"bond_based\"", "type = \"ordinary\""};

}  // namespace

TEST_CASE("bodies one point thick are refused, and the remedy is named") {
  for (const char* kinematics : of_all_kinds) {
    INFO(kinematics);
    if (contains(kinematics, "selective")) continue;  // not in plane stress
    const std::string line = refusal(2, lattice("6, 1"), kinematics);
    CHECK(contains(line, "thin.toml:2:1: body.dimension: found a body in 2 dimensions that is one point thick along y"));
    CHECK(contains(line, "allowed: dimension = 1, area = 1, or several points across"));
  }
  for (const char* kinematics : of_all_kinds) {
    INFO(kinematics);
    const std::string plate = refusal(3, lattice("6, 4, 1"), kinematics);
    CHECK(contains(plate, "found a body in 3 dimensions that is one point thick along z"));
    CHECK(contains(plate, "allowed: dimension = 2, plane = \"stress\", thickness = 1, or several points across"));
  }
  CHECK(contains(refusal(3, lattice("6, 1, 1")), "allowed: dimension = 1, area = 1"));
  CHECK(contains(refusal(2, lattice("2, 1")), "one point thick along y"));
}

TEST_CASE("clouds one point thick and pieces that are, beside thick ones, are refused") {
  TemporaryFolder folder;
  std::ofstream(folder.path / "plate.csv") << [] {
    std::string csv = "x,y,z,volume\n";   // in the plane x + z = 0
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 5; ++j) csv += fmt::format("{},{},{},1\n", i * 0.7071067811865476, j, -i * 0.7071067811865476);
    return csv;
  }();
  const std::string cloud = refusal(3, fmt::format("[body.points]\nfile = \"{}\"\n", (folder.path / "plate.csv").string()));
  CHECK(contains(cloud, "one point thick along ("));
  CHECK(contains(cloud, "dimension = 2, plane = \"stress\", thickness = ..."));
  const std::string piece = refusal(2, lattice("12, 12", "inside = \"y < 4 || y > 11\"\n"));
  CHECK(contains(piece, "found a piece of the body, at (0.5, 11.5, 0), in 2 dimensions that is one point thick along y (12 such points)"));
}

TEST_CASE("chips beside a body are warned of") {
  const std::string chip = "inside = \"y < 18 || (y > 20 && x < 2)\"\n";   // two points of 380
  CHECK(refusal(2, lattice("21, 21", chip)).empty());
  CHECK(contains(simulation_of(scene_of(2, lattice("21, 21", chip)))->summary(), "warning       2 points in pieces that are one point thick, 0.0053 of the volume of the body, the first one at (0.5, 20.5, 0)"));
  CHECK(contains(refusal(2, lattice("21, 21", "inside = \"y < 18 || (y > 20 && x < 6)\"\n")), "found a piece of the body, at (0.5, 20.5, 0)"));
}

TEST_CASE("bodies that are thick somewhere, and single points, are not refused") {
  for (const char* kinematics : {"type = \"baqp\"", "type = \"bond_based\"", "type = \"conventional\"\nstabilization = \"silling\""}) {
    INFO(kinematics);
    CHECK(refusal(2, lattice("2, 2"), kinematics).empty());
    CHECK(refusal(2, lattice("3, 2", "jitter = 0.2\n"), kinematics).empty());
    CHECK(refusal(3, lattice("2, 2, 2"), kinematics).empty());
    CHECK(refusal(2, lattice("12, 4", "inside = \"x < 4 || y < 1\"\n"), kinematics).empty());   // a tongue
    CHECK(refusal(2, lattice("12, 4", "inside = \"x < 4 || (x > 11 && y > 3)\"\n"), kinematics).empty());   // a point by itself
    CHECK(refusal(2, lattice("6, 1"), kinematics, "[[symmetry]]\naxis = \"y\"\n").empty());   // half of a body of two layers
    CHECK(refusal(3, lattice("4, 4, 1"), kinematics, "[[periodic]]\naxis = \"z\"\n").empty());
  }
}
