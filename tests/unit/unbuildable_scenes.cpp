// Scenes whose keys are each sound, and which only building can refuse: empty sets, laws and kinematics that do not go together,
// files that hold no body. Run through what `perikit check` runs through: the scene reader, then the simulation.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <fstream>

#include "tests/kit/messages.hpp"
#include "tests/kit/registry.hpp"
#include "unit/scene_draft.hpp"
#include "unit/temporary_folder.hpp"

using namespace perikit;
using namespace perikit::test;

namespace {

const char* const plate = R"(format = 1
[body]
dimension = 2
plane = "strain"
[body.lattice]
spacing = 1.0
lower = [0, 0]
upper = [6, 4]
inside = "x < 100"
[sets]
left = "x < 1"
[family]
horizon_ratio = 2.015
[kinematics]
type = "baqp"
[material]
type = "neo_hookean"
density = 1.0
shear_modulus = 1.0
bulk_modulus = 2.0
[[boundary]]
set = "left"
displacement = [0, 0]
[integrator]
type = "verlet"
end_time = 1.0
[output]
frames = 1
[run]
threads = 1
)";

/// One key of a section changed, then text appended; what the message points at, and what it says.
struct Fault {
  const char *section, *key, *value;
  const char* appended;
  int line;  ///< 0: the changed one; above 1000: line - 1000 of the appended text
  const char* path;
  const char* found;
  const char* allowed;
};

// A material of its own on the left.
#define REGION \
  "[[region]]\nset = \"left\"\nmaterial = { type = \"neo_hookean\", density = 1, shear_modulus = 1, bulk_modulus = 2 }\n"

#define SURFACE(level) "[[boundary]]\nsurface = \"" level "\"\ndisplacement = [0, 0]\n"

const Fault faults[]{
    {"sets", "left", "\"x < 0\"", "", 0, "sets.left", "found a condition that holds at no point",
     "one that holds at one point or more"},
    {"sets", "odd", "{ points = [0, 24] }", "", 0, "sets.odd", "found the point 24", "0 to 23"},
    {"sets", "odd", "{ points = [3, 3] }", "", 0, "sets.odd", "found the point 3 twice", "each point once"},
    {"sets", "bad", "\"sqrt(2 - x)\"", "", 0, "sets.bad", "found the expression \"sqrt(2 - x)\", which is nan at x = (2.5",
     "finite values"},
    {"body.lattice", "inside", "\"x < 0\"", "", 0, "body.lattice.inside", "keeps no point", "true at one point or more"},
    {"body.lattice", "inside", "\"log(-x)\"", "", 0, "body.lattice.inside", "nan at x = (0.5, 0.5, 0)", "finite values"},
    {"body.lattice", "upper", "[6, 0.4]", "", 6, "body.lattice.spacing", "about 0 points", "1 to"},
    {"body.lattice", "spacing", "0.00002", "", 2, "body.lattice", "found about 6e+10 points", "at most 2e+09 on a rank"},
    {"family", "horizon_ratio", "1e30", "", 2, "family", "found a horizon of 1e+30 spacings", "at most 1e+07"},
    {"family", "horizon_ratio", "2e3", "", 2, "family", "found a horizon of 2000 spacings", "at most 1e+07"},
    {"integrator", "end_time", "1e300", "", 0, "integrator.end_time", "found 1e+300 s", "at most 1e+15 steps"},
    // materials
    {"material", "density", "\"1 - x\"", "", 0, "material.density", "found -0.5 at (1.5", "a density > 0"},
    {"material", "shear_modulus", "\"x - 3\"", "", 0, "material.shear_modulus", "found shear_modulus = -2.5", "a value > 0"},
    {"material", "shear_modulus", "\"sqrt(2 - x)\"", "", 0, "material.shear_modulus", "is nan at x = (2.5", "finite values"},
    {"material", "bulk_modulus", "\"0 * x\"", "", 0, "material.bulk_modulus", "found bulk_modulus = 0", "a value > 0"},
    {"material", "type", "\"mooney_rivlin\"\nC1 = 1.0\nC2 = -2.0\nbulk_modulus = 1.0\ndensity = 1.0\n[constants]", "", 16,
     "material", "found C1 + C2 = -1", "a finite value > 0"},
    {"", "format", "1",
     "[[region]]\nset = \"left\"\nmaterial = { type = \"neo_hookean\", shear_modulus = 1, bulk_modulus = 1 }\n", 1003,
     "region.0.material.density", "found nothing", "a density > 0"},
    {"", "format", "1",
     "[[region]]\nset = \"left\"\nmaterial = { type = \"neo_hookean\", density = 1, youngs_modulus = 3, shear_modulus = 1 }\n",
     1003, "region.0.material", "found shear_modulus|found bulk_modulus", "from the two constants given"},
    {"integrator", "type", "\"newton\"\n[constants]", "[initial]\nvelocity = [0, 1]\n", 1002, "initial.velocity",
     "found with integrator \"newton\"", "dynamic"},
    // kinematics
    {"kinematics", "type", "\"selective\"\nbase = \"conventional\"", "", 16, "kinematics.base", "found 'conventional'",
     "bonds or sub-horizons"},
    {"kinematics", "type", "\"selective\"\nbase = { type = \"selective\", base = \"baqp\" }", "", 16, "kinematics.base",
     "found 'selective' itself", "bonds or sub-horizons"},
    {"kinematics", "type", "\"selective\"\nbase = \"baqp\"\nforce_state = \"local\"", "", 17, "kinematics.force_state",
     "found 'local' over 'baqp'", "bond_associated"},
    {"kinematics", "stabilization", "\"silling\"", "", 0, "kinematics.stabilization", "found 'silling' over baqp",
     "one gradient per point"},
    {"kinematics", "type", "\"sub_horizon\"\nparts = 2", "", 16, "kinematics.parts", "found 2 in a body of dimension 2", "4"},
    {"kinematics", "type", "\"conventional\"\norder = 4", "", 16, "kinematics.order", "found 4, for which a family needs 14 bonds and more; the largest one here has 11",
     "1 to 3, or a wider horizon"},
    {"kinematics", "type", "\"conventional\"\ncell_moments = true", "", 16, "kinematics.cell_moments", "found true with order = 1", "order = 2 or more, or false"},
    {"kinematics", "type", "\"selective\"\nbase = { type = \"baqp\", order = 8 }", "", 16, "kinematics.base.order", "found 8, for which a family needs 44 bonds",
     "1 to 3, or a wider horizon"},
    {"family", "influence", "{ type = \"expression\", formula = \"r -\" }", "", 0, "family.influence.formula", "found \"r -\"",
     "an expression in r"},
    {"family", "influence", "{ type = \"expression\", formula = \"1 - 2*r\" }", "", 0, "family.influence.formula",
     "found \"1 - 2*r\"", "finite values >= 0"},
    {"family", "influence", "{ type = \"expression\", formula = \"0*r\" }", "", 0, "family.influence.formula", "zero for every r",
     "positive somewhere"},
    // damage
    {"", "format", "1", "[damage]\ntype = \"smooth_degradation\"\nstretch_min = 0.3\nstretch = 0.2\n", 1003, "damage.stretch_min",
     "found 0.3", "below stretch = 0.2"},
    {"", "format", "1", "[damage]\ntype = \"critical_stretch\"\nstretch = 0.3\nconsistent = true\n", 1004, "damage.consistent",
     "found true", "only with energy_release_rate"},
    {"kinematics", "type", "\"bond_associated\"\nforce_state = \"local\"",
     "[damage]\ntype = \"critical_stretch\"\nstretch = 0.3\n", 1001, "damage", "found with kinematics.force_state",
     "variational"},
    {"integrator", "type", "\"evaluate\"\n[constants]", "[damage]\ntype = \"critical_stretch\"\nstretch = 0.3\n", 0,
     "integrator.type", "found \"evaluate\" in a scene with [damage]", "another integrator"},
    {"", "format", "1", "[damage]\ntype = \"smooth_degradation\"\nstretch_min = 0.1\nstretch = 0.2\ngradual = true\n", 1005, "damage.gradual",
     "found true with \"smooth_degradation\"", "criteria that break bonds at once"},
    {"integrator", "type", "\"newton\"\n[constants]", "[damage]\ntype = \"critical_stretch\"\nstretch = 0.3\ngradual = true\n", 1004, "damage.gradual",
     "found true with integrator \"newton\"", "explicit integrators"},
    {"", "format", "1",
     REGION "[damage]\ntype = \"critical_energy\"\nenergy_release_rate = 1.0\n[[interface]]\nbetween = [\"left\", \"rest\"]\n"
            "damage = { type = \"critical_energy\", energy_release_rate = 0.5, softening = 4 }\n",
     1009, "interface.0.damage", "found bonds that weaken, unlike those of [damage]", "the same for both"},
    {"", "format", "1",
     REGION "[damage]\ntype = \"smooth_degradation\"\nstretch_min = 0.1\nstretch = 0.2\n[[interface]]\nbetween = [\"left\", \"rest\"]\n"
            "damage = { type = \"smooth_degradation\", stretch_min = 0.1, stretch = 0.3 }\n",
     1010, "interface.0.damage", "whose bonds weaken by more numbers than two limits", "break bonds at once"},
    // conditions
    {"boundary", "displacement", "[\"log(x - 3)\", 0]", "", 0, "boundary.0.displacement", "nan at x", "finite values"},
    {"", "format", "1", "[initial]\nvelocity = [\"1/(x - 0.5)\", 0]\n", 1002, "initial.velocity", "inf at x = (0.5",
     "finite values"},
    {"", "format", "1", "[initial]\ndisplacement = [0, \"sqrt(1 - y)\"]\n", 1002, "initial.displacement", "nan at x",
     "finite values"},
    {"integrator", "type", "\"newton\"\n[constants]", "[[boundary]]\nset = \"left\"\nvelocity = [0, 0]\n", 1003,
     "boundary.1.velocity", "found in a quasi-static run", "displacement"},
    {"sets", "middle", "\"x > 2 && x < 3\"", "[[load]]\nset = \"middle\"\ntraction = [1, 0]\nface = \"+x\"\n", 1004, "load.face",
     "on which no point of the set \"middle\" lies", "a face of the set"},
    // faces, symmetry, periodic sides
    {"", "format", "1", "[[boundary]]\nface = \"-x\"\ndisplacement = [1, 0]\n", 23, "boundary.0", "found the point at (0.5, 0.5, 0) held in x",
     "one of them"},
    {"", "format", "1", "[[boundary]]\nface = \"+x\"\nat = 5.7\ndisplacement = [1, 0]\n", 1003, "boundary.1.at",
     "found 5.7, which does not lie half-way between points", "6"},
    {"", "format", "1", "[[boundary]]\nface = \"+x\"\nat = 9.0\ndisplacement = [1, 0]\n", 1003, "boundary.1.face",
     "which no point of the set \"all\" touches", "a face of the set"},
    {"", "format", "1", "[[boundary]]\nface = \"+x\"\nat = 3.0\ndisplacement = [1, 0]\n", 1003, "boundary.1.face",
     "found a plane through the body, at 3", "all points on one side"},
    {"", "format", "1", "[[boundary]]\nface = \"+x\"\nset = \"left\"\ndisplacement = [1, 0]\n", 1002, "boundary.1.face",
     "found an image of a point on another point", "nothing beyond it"},
    {"", "format", "1",
     "[[boundary]]\nface = \"+x\"\ndisplacement = [1, 0]\n[[boundary]]\nface = \"+x\"\ndisplacement = [\"free\", 0]\n", 1005,
     "boundary.2.face", "whose component y boundary.1", "each once"},
    {"", "format", "1", "[[boundary]]\nface = \"+x\"\ndisplacement = [1, 0]\n[[symmetry]]\naxis = \"x\"\nat = 6.0\n", 1006, "symmetry.0",
     "found a side, at 6, that boundary.1.face has too", "one of the two"},
    {"", "format", "1", "[[symmetry]]\naxis = \"y\"\nat = 2.0\n", 1003, "symmetry.0.at", "found a plane through the body, at 2",
     "all points on one side"},
    {"", "format", "1", "[[periodic]]\naxis = \"y\"\n[[symmetry]]\naxis = \"y\"\n", 1002, "periodic.0.axis",
     "found a side, at 0, that symmetry.0.axis has too", "one of the two"},
    {"boundary", "displacement", "[\"free\", \"free\"]", "[[boundary]]\nface = \"+x\"\nvelocity = [1, 0]\n[[boundary]]\nface = \"+y\"\ndisplacement = [1, \"free\"]\n", 1003,
     "boundary.1.velocity", "found a face with a velocity beside one with a displacement", "the same key for both"},
    {"integrator", "type", "\"newton\"\n[constants]", "[[boundary]]\nface = \"+x\"\nvelocity = [0, 0]\n", 1003,
     "boundary.1.velocity", "found in a quasi-static run", "displacement"},
    // held surfaces
    {"", "format", "1", SURFACE("x - 6"), 1002, "boundary.1.surface", "found it on a lattice, which has no places", "family.partial_volume = true"},
    {"body.lattice", "jitter", "0.1", SURFACE("x - 16"), 1002, "boundary.1.surface", "found a surface that no point touches", "zero on a side of the body"},
    {"body.lattice", "jitter", "0.1", SURFACE("x - 4.2"), 1002, "boundary.1.surface", "found a surface in front of the point at (", "negative at all points"},
    {"body.lattice", "jitter", "0.1", SURFACE("abs(y - 2) - 2.1"), 1002, "boundary.1.surface", "that another part of itself comes near", "for each of two sides"},
    {"body.lattice", "jitter", "0.1", SURFACE("sqrt(4 - x) - 9"), 1002, "boundary.1.surface", "is nan at x = (", "finite values"},
    {"body.lattice", "jitter", "0.1", SURFACE("x - 6.2") SURFACE("2*x - 12.4"), 1005, "boundary.2.surface", "found a surface that boundary.1.surface has too", "one of the two"},
    {"body.lattice", "jitter", "0.1", SURFACE("x - 6.2") "[[symmetry]]\naxis = \"x\"\nat = 6.2\n", 1002, "boundary.1.surface",
     "found a surface that symmetry.0.axis has too", "one of the two"},
    {"body.lattice", "jitter", "0.1", SURFACE("-0.3 - x"), 24, "boundary.0", "held in x, and its face by another", "one of them"},
    {"kinematics", "type", "\"bond_based\"", "[[output.history]]\nname = \"s\"\nquantity = \"shape_tensor_condition\"\n",
     1003, "output.history.0.quantity", "found \"shape_tensor_condition\"", "displacement"},
};

struct Bench {
  TemporaryFolder folder;
  /// What refuses the scene, "" where nothing does.
  std::string refusal(const std::string& text) const {
    return message_of<InputError>([&] { simulation_of(text, folder.path / "scene.toml")->summary(); });
  }
};

/// The plate with its points from cloud.csv.
std::string plate_from_file() {
  std::string text = plate;
  const std::size_t begin = text.find("[body.lattice]"), end = text.find("[sets]");
  return text.replace(begin, end - begin, "[body.points]\nfile = \"cloud.csv\"\n");
}
std::string cloud() {
  std::string csv = "x,y,volume\n";
  for (int k = 0; k < 24; ++k) csv += fmt::format("{},{},1\n", k % 6 + 0.5, k / 6 + 0.5);
  return csv;
}

}  // namespace

TEST_CASE("scenes that cannot be built are refused with file, line, key, what was found and what is allowed") {
  Bench bench;
  REQUIRE(bench.refusal(plate).empty());
  for (const Fault& fault : faults) {
    SceneDraft draft{std::string(plate)};
    const int changed = draft.set(fault.section, fault.key, fault.value).line;
    const std::string before = draft.text();
    const int end = static_cast<int>(std::count(before.begin(), before.end(), '\n'));
    const int line = fault.line == 0 ? changed : fault.line > 1000 ? end + fault.line - 1000 : fault.line;
    const std::string message = bench.refusal(before + fault.appended), key = fault.path;
    CAPTURE(before + fault.appended);
    CAPTURE(message);
    CHECK_MESSAGE(message.starts_with(fmt::format("{}:{}:", (bench.folder.path / "scene.toml").string(), line)), "line ", line);
    const std::size_t at = message.find(": " + key);
    CHECK_MESSAGE(at != std::string::npos, "key ", key);
    const std::string found = fault.found, first = found.substr(0, found.find('|')), second = found.substr(found.find('|') + 1);
    CHECK_MESSAGE((contains(message, first) || contains(message, second)), "found: ", found);
    const std::size_t allowed = message.find("; allowed: ");
    CHECK_MESSAGE((allowed != std::string::npos && contains(message.substr(allowed), fault.allowed)), "allowed: ", fault.allowed);
    CHECK(contains(message, "found "));
  }
}

TEST_CASE("a horizon too short for the factors of a pair law is refused, and not without them or on a line") {
  Bench bench;
  for (const std::string law : {"bond_based", "ordinary"}) {
    std::string text = plate;
    text.replace(text.find("2.015"), 5, "1.015").replace(text.find("type = \"baqp\""), 13, "type = \"" + law + "\"\nsurface_correction = \"moments\"");
    const std::string message = bench.refusal(text);
    CHECK(contains(message, "kinematics.surface_correction: found \"moments\" with a horizon of 1.015 spacings, whose bonds are too few for the stiffness of the material"));
    CHECK(contains(message, "allowed: a longer horizon, from 1.5 spacings on, or surface_correction = \"none\""));
    std::string wider = text, without = text;
    CHECK(bench.refusal(wider.replace(wider.find("1.015"), 5, "1.515")).empty());
    CHECK(bench.refusal(without.replace(without.find("\"moments\""), 9, "\"none\"")).empty());
  }
}

TEST_CASE("sides of points from a file are found by volumes, and must be placed where these do not say") {
  Bench bench;
  std::string text = plate_from_file();
  text.replace(text.find("set = \"left\""), 12, "face = \"-x\"");
  std::ofstream(bench.folder.path / "cloud.csv") << cloud();
  CHECK(bench.refusal(text).empty());
  std::string uneven = cloud();
  uneven.replace(uneven.find("0.5,1.5,1"), 9, "0.7,1.5,1");
  std::ofstream(bench.folder.path / "cloud.csv") << uneven;
  CHECK(contains(bench.refusal(text), "boundary.0.at: found nothing for points from a file, whose outermost lies at 0.5 and is no part of a layer; allowed: the coordinate of the side"));
  text.replace(text.find("face = "), 0, "at = 0.0\n");
  CHECK(bench.refusal(text).empty());
}

TEST_CASE("files that hold no body are refused with file, line, column and what is allowed") {
  Bench bench;
  const std::string text = plate_from_file(), good = cloud();
  const auto refusal = [&](const std::string& csv) {
    std::ofstream(bench.folder.path / "cloud.csv") << csv;
    return bench.refusal(text);
  };
  REQUIRE(refusal(good).empty());
  const auto changed = [&](const std::string& from, const std::string& to) {
    std::string csv = good;
    return refusal(csv.replace(csv.find(from), from.size(), to));
  };
  const struct {
    std::string from, to, message;
  } cases[] = {{"1.5,0.5,1", "1.5,0.5,0", "cloud.csv:3:9: volume: found 0; allowed: a number > 0"},
               {"1.5,0.5,1", "1.5,0.5,-1", "cloud.csv:3:9: volume: found -1; allowed: a number > 0"},
               {"1.5,0.5,1", "nan,0.5,1", "cloud.csv:3:1: x: found nan; allowed: a finite number"},
               {"1.5,0.5,1", "1.5,inf,1", "cloud.csv:3:5: y: found inf; allowed: a finite number"},
               {"1.5,0.5,1", "1.5,word,1", "cloud.csv:3:5: y: found 'word'; allowed: a number"},
               {"1.5,0.5,1", "1.5,0.5", "cloud.csv:3:1: found 2 cells; allowed: 3"},
               {"1.5,0.5,1", "0.5,0.5,1",
                "scene.toml:2:1: body.points: found two points at (0.5, 0.5, 0); allowed: points at different places"},
               {"1.5,0.5,1", "0.500000000000001,0.5,1",
                "scene.toml:2:1: body.points: found two points at (0.5, 0.5, 0); allowed: points at different places"},
               {"x,y,volume", "x,y,weight", "cloud.csv:1:5: found column 'weight'; allowed: x,y,z,volume"},
               {"x,y,volume", "x,z,volume", "cloud.csv:1:1: found no column 'y'"}};
  for (const auto& c : cases) {
    const std::string message = changed(c.from, c.to);
    CHECK_MESSAGE(contains(message, c.message), c.message, " is not in: ", message);
  }
  CHECK(contains(refusal("x,y,volume\n"), "cloud.csv: found no points behind the header line; allowed: one or more"));
  CHECK(contains(refusal(""), "cloud.csv: found no header line; allowed: x,y,volume"));
  // Areas of a plate that is thin: a hundred times the volumes that there is room for.
  {
    SceneDraft thin(text);
    thin.set("body", "thickness", "0.01");
    std::ofstream(bench.folder.path / "cloud.csv") << good;
    const std::string message = bench.refusal(thin.text());
    CHECK_MESSAGE(contains(message, "body.points.file: found volumes that add up to 24 m^3, 100 times the 0.24 m^3 that the points have room for: their box is 6 m long in x, 4 m in y, "
                               "with a thickness of 0.01 m"),
                  message);
    CHECK_MESSAGE(contains(message, "allowed: volumes in m^3, areas times the thickness"), message);
  }
  // A horizon that no bond fits into.
  SceneDraft draft(text);
  draft.set("family", "horizon_ratio", "0.4", "horizon");
  std::ofstream(bench.folder.path / "cloud.csv") << good;
  const std::string message = bench.refusal(draft.text());
  CHECK_MESSAGE(contains(message, "family.horizon: found 0.4; allowed: at least the mean spacing of the points, 1"), message);
}
