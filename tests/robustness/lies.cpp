/// Parts that lie (tests/contract/lies) are caught by `perikit contract`, each by the test case that states what it breaks.

#include <doctest/doctest.h>

#include <algorithm>
#include <map>
#include <set>

#include "perikit/plugin/abi.hpp"
#include "robustness/desk.hpp"

using namespace perikit::test;

namespace {

struct Lie {
  std::string name, kind;
  std::set<std::string> broken;   ///< test cases
};

const std::vector<Lie> lies{
    {"fixed_axes", "material", {"material: stress turns with the body, and an isotropic law has no directions"}},
    {"wrong_tangent", "material", {"material: stress is the derivative of the energy, the tangent that of the stress"}},
    {"wrong_stress", "material", {"material: stress is the derivative of the energy, the tangent that of the stress"}},
    {"twice_the_bulk", "material", {"material: a law that tells shape and volume apart is the sum of both"}},
    {"half_told", "material", {"material: a law with history follows paths: objective, exact tangent, its history in its own place, its energy accounted for"}},
    {"loud", "material", {"material: what a law remembers has names, units and shapes that fields can have"}},
    {"forgotten_lane", "material", {"material: a batch is its points one at a time, writes all of its outputs and nothing else"}},
    {"one_sided", "kinematics", {"kinematics: bitwise the same for one, two and three threads, and to rounding without savings"}},
    {"opposite_force", "kinematics", {"kinematics: force = -dE/du, tangent = dF/du, symmetric"}},
    {"company", "influence", {"influence: bitwise the same for one point, for many, and again"}},
    {"other_force", "term", {"term: force = -de/du where it is conservative, tangent = df/du"}},
    {"no_slope", "term", {"term: a batch is its points one at a time, writes all of its outputs and nothing else"}},
    {"no_number", "term", {"term: a batch is its points one at a time, writes all of its outputs and nothing else"}},
    {"clock", "term", {"term: traits are true"}},
    {"healing", "damage", {"damage: 1 up to the onset, 0 beyond failure, never rising, bits where declared"}},
    {"forgetful", "integrator", {"integrator: a run that continues from a saved state is bitwise the run without a stop"}},
    {"first_order", "integrator", {"integrator: displacements and energy converge with the square of the time step"}},
    {"free_lunch", "integrator", {"integrator: a constant load gives a free body its momentum, and work is force times distance"}},
};

std::set<std::string> broken_cases(const std::string& out) {
  std::set<std::string> names;
  for (const std::string& line : lines(out))
    if (line.starts_with("broken: ")) names.insert(line.substr(8));
  return names;
}

}  // namespace

TEST_CASE("contract: every lie is caught by the test case of what it breaks") {
  const Desk desk;
  for (const Lie& lie : lies) {
    const Result result = desk.perikit(fmt::format("contract '{}/{}.so'", PERIKIT_LIES, lie.name));
    INFO(lie.name);
    CHECK(result.status == 1);
    const std::set<std::string> broken = broken_cases(result.out);
    for (const std::string& name : lie.broken) CHECK_MESSAGE(broken.contains(name), "not caught by '", name, "' but by ", fmt::format("{}", fmt::join(broken, "; ")));
    CHECK(contains(result.out, fmt::format("{}/{} breaks its contract", lie.kind, lie.name)));
    // What broke is said with numbers, once for each check: not once for each of a thousand points.
    CHECK(contains(result.out, "    expected "));
    const auto said = std::ranges::count_if(lines(result.out), [](const std::string& line) { return !line.starts_with("kept:"); });
    CHECK_MESSAGE(said < 100, lie.name, ": ", said, " lines beside those of test cases that are kept");
  }
}

TEST_CASE("contract: what breaks is named with numbers, and how often it breaks") {
  const Desk desk;
  const std::string out = desk.perikit(fmt::format("contract '{}/wrong_stress.so'", PERIKIT_LIES)).out;
  for (const std::string word : {"material/wrong_stress\n", "kept:   material: ", "broken: material: stress is the derivative of the energy", "P : dF = dpsi (differences): ", "error ", " > 1e-",
                                 "   (material_check.hpp:", " times more\n", " test cases kept; "})
    CHECK_MESSAGE(contains(out, word), "no '", word, "' in\n", out);
}

TEST_CASE("contract: kinematics that are none of the classes are refused by name, by the suite and by scenes") {
  const std::string base = "the base that it maps is neither a BondKinematics nor a WeightedKinematics";
  const std::map<std::string, std::string> reasons{
      {"unclassed", "it is none of PointKinematics, BondKinematics, WeightedKinematics, PairKinematics and MappedKinematics"},
      {"mapped_points", base},
      {"mapped_twice", base}};
  const std::string library = fmt::format("{}/no_class.so", PERIKIT_LIES);
  const Desk desk(replaced(plate, "format = 1", fmt::format("format = 1\nplugins = [\"{}\"]", library)));
  const Result suite = desk.perikit(fmt::format("contract '{}'", library));
  CHECK(suite.status == 1);
  for (const auto& [name, reason] : reasons) {
    CHECK(contains(suite.out, fmt::format("kinematics/{} breaks its contract", name)));
    const std::string refusal = fmt::format("kinematics '{}' of {} cannot be made: {}", name, library, reason);
    CHECK_MESSAGE(contains(suite.out, refusal), "no '", refusal, "' in\n", suite.out);
    const Result scene = desk.perikit("check scene.toml --trust --set kinematics.type=" + name);
    CHECK(scene.status == 2);
    CHECK_MESSAGE(contains(scene.err, refusal), scene.err);
  }
}

TEST_CASE("contract: without perikit's own parts there is nothing to test with") {
  const Desk desk;
  // A framework library that has no folder of plugins beside it.
  fs::create_directories(desk.path("lib"));
  const std::string library = "libperikit.so." PERIKIT_STRINGIFY(PERIKIT_ABI_VERSION);
  fs::copy_file(fs::path(PERIKIT_PARTS).parent_path() / library, desk.path("lib/" + library));
  const Result result = desk.perikit(fmt::format("contract '{}/company.so'", PERIKIT_LIES), "unset PERIKIT_PLUGIN_PATH; LD_LIBRARY_PATH=lib");
  CHECK(result.status == 2);
  CHECK_MESSAGE(contains(result.err, "need the parts that come with perikit"), result.err);
}

TEST_CASE("contract: exit status 2 for what is no library of parts") {
  const Desk desk;
  for (const std::string file : {"nowhere.so", "scene.toml"}) {
    const Result result = desk.perikit("contract " + file);
    CHECK(result.status == 2);
    CHECK_MESSAGE(contains(result.err, file + ": this library is refused: "), result.err);
  }
}
