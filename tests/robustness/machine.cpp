/// `perikit check --machine`: silent where the build is right, and what it says where it is wrong.

#include <doctest/doctest.h>

#include "perikit/plugin/abi.hpp"
#include "robustness/desk.hpp"

using namespace perikit::test;

TEST_CASE("machine: this build computes what is stored, and says its level") {
  const Desk desk;
  const Result check = desk.perikit("check --machine");
  CHECK_MESSAGE(check.status == 0, check.err);
  CHECK_MESSAGE(contains(check.out, "level " PERIKIT_LEVEL ": energies and forces of 20 parts"), check.out);
  CHECK(contains(desk.perikit("--version").out, PERIKIT_LEVEL));
  CHECK(contains(desk.perikit("check scene.toml").out, "# perikit       0.1.0 (" PERIKIT_LEVEL ")"));
  CHECK(desk.perikit("check").status == 2);
  CHECK(desk.perikit("check --machine scene.toml").status != 0);
}

TEST_CASE("machine: a kinematics that computes something else is named with the difference, one that crashes too, each with the remedy") {
  const Desk desk;
  const Result check = desk.perikit(std::string("check --machine --plugin-path ") + PERIKIT_WRONG_BUILD);
  CHECK(check.status == 1);
  INFO(check.err);
  CHECK(contains(check.err, "kinematics/bond_based on a lattice in 2D: the forces differ by "));
  CHECK(contains(check.err, "kinematics/bond_based on a cloud in 3D: the forces differ by "));
  CHECK(contains(check.err, "kinematics/sub_horizon on a lattice in 2D: crashes (Segmentation fault)"));
  CHECK(!contains(check.err, "kinematics/baqp"));
  CHECK(!contains(check.err, "the energy"));
  CHECK(contains(check.err, "level " PERIKIT_LEVEL));
  CHECK(contains(check.err, "Do not use this build"));
  CHECK(contains(check.err, "cmake --preset release -B build/"));
}

TEST_CASE("machine: what is written is what is compared with") {
  const Desk desk;
  CHECK(desk.perikit("check --machine --write values.csv").status == 0);
  CHECK(lines(read(desk.path("values.csv"))).size() == lines(read(fs::path(PERIKIT_PROGRAM).parent_path().parent_path() / "share/perikit/machine_values.csv")).size());
  CHECK(desk.perikit("check scene.toml --write values.csv").status == 2);
}
