// Every refusal of a scene: the line it points at, the key it names, and a fragment of its message.
#include <doctest/doctest.h>

#include <algorithm>
#include <sstream>

#include "scene/scene.hpp"
#include "unit/fake_catalogue.hpp"

using namespace perikit;
using namespace perikit::test;

namespace {

// A sound scene; each case replaces one of its lines by other text, or appends text at its end.
const char* const sound = R"(format = 1
title = "plate"
[constants]
w = 1.0
[body]
dimension = 2
plane = "strain"
[body.lattice]
spacing = 0.1
lower = [0, 0]
upper = [1, 1]
[sets]
left = "x < 0.1"
tip = { nearest = [1, 1] }
[family]
horizon_ratio = 3
[kinematics]
type = "baqp"
order = 2
[material]
type = "neo_hookean"
shear_modulus = 1.0
bulk_modulus = 2.0
[[boundary]]
set = "left"
displacement = [0, 0]
[integrator]
type = "newton"
)";

// Up to the value of interface.0.between.
#define INTERFACE                                                                                                      \
  "[[region]]\nset = \"left\"\nmaterial = { type = \"neo_hookean\", shear_modulus = 1, bulk_modulus = 1 }\n[damage]\n" \
  "type = \"critical_stretch\"\nstretch = 0.1\n[[interface]]\nbetween = "

struct Case {
  int line;  // replaced, 0: text is appended
  const char* text;
  int at;  // line of the message
  const char* key;
  const char* fragment;
};

const Case cases[]{
    // top level
    {1, "format = 2", 1, "format", "found the integer 2; allowed: an integer >= 1 and <= 1"},
    {1, "format = 1.0", 1, "format", "found the number 1.0; allowed: an integer"},
    {1, "format = true", 1, "format", "found the boolean true; allowed: an integer"},
    {1, "", 1, "format", "found nothing; allowed: an integer"},
    {2, "title = 3", 2, "title", "found the integer 3; allowed: a string"},
    {2, "tilte = \"plate\"", 2, "tilte", "did you mean 'title'?"},
    {2, "plugins = \"law.so\"", 2, "plugins", "allowed: a list of strings"},
    {2, "plugins = [\"law.so\"]", 2, "plugins", "opened only with --trust"},
    {2, "title = 1979-05-27", 2, "title", "found a date or time"},
    {0, "[contact]\nstiffness = 1", 29, "contact", "reserved for a later version"},
    {0, "[[stage]]\nsteps = 1", 29, "stage", "reserved for a later version"},
    {5, "[[body]]", 5, "body", "reserved for a later version"},
    {0, "[bondary]\nset = \"left\"", 29, "bondary", "did you mean 'boundary'?"},
    // constants
    {4, "w = \"one\"", 4, "constants.w", "unknown name 'one'"},
    {4, "w = true", 4, "constants.w", "found the boolean true; allowed: a number"},
    {4, "w = inf", 4, "constants.w", "found the number inf"},
    {4, "w = \"2*v\"", 4, "constants.w", "unknown name 'v'"},
    {4, "w = \"2*x\"", 4, "constants.w", "depends on the position"},
    {4, "w = \"2*w\"", 4, "constants.w", "found \"2*w\", which depends on itself"},
    {4, "w = \"2*v\"\nv = \"w + 1\"", 5, "constants.v", "found \"w + 1\", which depends on itself"},
    {4, "x = 1", 4, "constants.x", "which expressions use already"},
    {4, "sin = 1", 4, "constants.sin", "which expressions use already"},
    {4, "\"a b\" = 1", 4, "constants.a b", "allowed: letters, digits and _"},
    {3, "constants = 4\n[other]", 3, "constants", "allowed: a table [constants]"},
    // body
    {6, "dimension = 2.0", 6, "body.dimension", "found the number 2.0; allowed: an integer"},
    {6, "dimension = 4", 6, "body.dimension", "allowed: an integer >= 1 and <= 3"},
    {6, "", 5, "body.dimension", "found nothing"},
    {6, "dimension = 3", 7, "body.plane", "found in a body of dimension 3; allowed: only with dimension = 2"},
    {6, "dimension = 3", 10, "body.lattice.lower", "found a list of 2; allowed: a list of 3"},
    {7, "", 5, "body.plane", "found nothing; allowed: \"strain\" or \"stress\""},
    {7, "plane = \"strian\"", 7, "body.plane", "did you mean 'strain'?"},
    {7, "plane = \"strain\"\narea = 1", 8, "body.area", "allowed: only with dimension = 1"},
    {7, "plane = \"strain\"\nthickness = -1", 8, "body.thickness", "found the integer -1; allowed: a number > 0 [m]"},
    {7, "plane = \"strain\"\npoints = { file = \"a.csv\" }", 5, "body", "found lattice, points; allowed: exactly 1"},
    {8, "[body.latice]", 8, "body.latice", "did you mean 'lattice'?"},
    {8, "[body.latice]", 5, "body", "found none of them; allowed: exactly 1 of [body.lattice], [body.points]"},
    {9, "spacing = 0", 9, "body.lattice.spacing", "allowed: a number > 0 [m]"},
    {9, "spacing = nan", 9, "body.lattice.spacing", "found the number nan"},
    {9, "spacing = \"0.1*x\"", 9, "body.lattice.spacing", "found the string \"0.1*x\"; allowed: a number > 0 [m], or an expression in [constants]"},
    {9, "spacing = \"1/0\"", 9, "body.lattice.spacing", "found the string \"1/0\"; allowed: a number > 0 [m]"},
    {9, "spacing = \"-w\"", 9, "body.lattice.spacing", "found the string \"-w\" = -"},
    {9, "spacing = true", 9, "body.lattice.spacing", "found the boolean true"},
    {9, "spacing = 1e-9", 9, "body.lattice.spacing", "which gives about 1e+18 points"},
    {9, "spacing = 5.0", 9, "body.lattice.spacing", "which gives about 0 points"},
    {9, "spacing = 0.1\njitter = 0.7", 10, "body.lattice.jitter", "allowed: a number >= 0 and <= 0.5"},
    {9, "spacing = 0.1\ninside = \"x < q\"", 10, "body.lattice.inside", "unknown name 'q' at character 5"},
    {10, "lower = [0, 0, 0]", 10, "body.lattice.lower", "found a list of 3; allowed: a list of 2"},
    {10, "lower = [0, \"a\"]", 10, "body.lattice.lower.1", "found the string \"a\"; allowed: a number"},
    {10, "lower = 0", 10, "body.lattice.lower", "found the integer 0; allowed: a list of numbers"},
    {11, "upper = [1, 0]", 11, "body.lattice.upper.1", "found 0; allowed: above lower = 0"},
    {11, "", 8, "body.lattice.upper", "found nothing"},
    // sets
    {13, "left = \"x <\"", 13, "sets.left", "it ends too early"},
    {13, "left = \"x < t\"", 13, "sets.left", "t is not allowed here"},
    {13, "left = 1", 13, "sets.left", "found the integer 1; allowed: an expression"},
    {13, "left = \"x < 1\"\nall = \"x < 1\"", 14, "sets.all", "that set exists"},
    {13, "left = \"x < 1\"\n\"a/b\" = \"x < 1\"", 14, "sets.a/b", "without /"},
    {14, "tip = { nearest = [1] }", 14, "sets.tip.nearest", "found a list of 1; allowed: a list of 2"},
    {14, "tip = { points = [0, 1.0] }", 14, "sets.tip.points.1", "found the number 1.0"},
    {14, "tip = { points = [\"w/4\"] }", 14, "sets.tip.points.0", "found the string \"w/4\" = 0.25; allowed: an integer >= 0, or an expression in [constants]"},
    {14, "tip = { points = [-1] }", 14, "sets.tip.points.0", "found the integer -1; allowed: an integer >= 0"},
    {14, "tip = { points = [] }", 14, "sets.tip.points", "found a list of 0"},
    {14, "tip = { nearest = [1, 1], points = [0] }", 14, "sets.tip", "exactly 1 of nearest, points"},
    {14, "tip = { nearst = [1, 1] }", 14, "sets.tip.nearst", "did you mean 'nearest'?"},
    // family
    {16, "", 15, "family", "found none of them; allowed: exactly 1 of horizon_ratio, horizon"},
    {16, "horizon_ratio = 3\nhorizon = 0.3", 15, "family", "found horizon_ratio, horizon; allowed: exactly 1"},
    {16, "horizon_ratio = 0.5", 16, "family.horizon_ratio", "allowed: a number >= 1"},
    {16, "horizon = 0.05", 16, "family.horizon", "allowed: at least the spacing 0.1"},
    {16, "horizon_ratio = 3\ninfluence = \"gausian\"", 17, "family.influence",
     "found the unknown influence 'gausian'; allowed: constant, expression, gaussian; did you mean 'gaussian'?"},
    {16, "horizon_ratio = 3\ninfluence = { type = \"expression\" }", 17, "family.influence.omega",
     "found nothing; allowed: a string"},
    // parts
    {18, "type = \"bapq\"", 18, "kinematics.type",
     "found the unknown kinematics 'bapq'; allowed: baqp, conventional, non_spherical, selective; did you mean 'baqp'?"},
    {18, "", 17, "kinematics.type", "found nothing; allowed: the name of one; known: baqp, conventional"},
    {18, "type = 3", 18, "kinematics.type", "found the integer 3"},
    {19, "order = 3", 19, "kinematics.order", "allowed: an integer >= 1 and <= 2"},
    {19, "ordre = 2", 19, "kinematics.ordre", "did you mean 'order'?"},
    {19, "stabilization = \"siling\"", 19, "kinematics.stabilization", "did you mean 'silling'?"},
    {18, "type = \"selective\"\nbase = { type = \"baqp\", order = 0 }\n[kinematics.x]", 19, "kinematics.base.order",
     "found the integer 0"},
    {20, "[materials]", 20, "materials", "did you mean 'material'?"},
    {20, "[materials]", 1, "material", "found nothing; allowed: the name of a material"},
    {22, "shear_modulus = -1", 22, "material.shear_modulus",
     "found the integer -1; allowed: a number > 0 [Pa], or an expression in x, y, z"},
    {22, "shear_modulus = \"1 + t\"", 22, "material.shear_modulus", "t is not allowed here"},
    {22, "", 20, "material", "found bulk_modulus only; allowed: exactly 2 of"},
    {22, "shear_modulus = 1\nvolumetric = \"cubic\"", 23, "material.volumetric", "allowed: \"quadratic\" or \"logarithmic\""},
    {0, "[damage]\ntype = \"critical_stretch\"", 29, "damage", "found none of them"},
    {0, "[damage]\ntype = \"critical_stretch\"\nstretch = 0.1\nno_fail = [\"tap\"]", 32, "damage.no_fail", "did you mean 'tip'?"},
    {28, "type = \"verlet\"", 27, "integrator.end_time", "found nothing; allowed: a number > 0 [s]"},
    {28, "type = \"verlet\"\nend_time = 1\nsafety = 0.5\ntime_step = 1", 27, "integrator",
     "found time_step, safety; allowed: at most 1"},
    // regions and cracks
    {0, "[[region]]\nset = \"hole\"\nmaterial = { type = \"neo_hookean\", shear_modulus = 1, bulk_modulus = 1 }", 30,
     "region.0.set", "unknown set \"hole\""},
    {0, "[[region]]\nset = \"left\"", 29, "region.0.material", "found nothing"},
    {0, "[[region]]\nset = \"left\"\nmaterial = \"neo_hookean\"", 31, "region.0.material", "exactly 2 of"},
    {0, "[[region]]\nset = \"left\"\ndamage = \"x\"\nmaterial = { type = \"neo_hookean\", shear_modulus = 1, bulk_modulus = 1 }",
     31, "region.0.damage", "reserved for a later version"},
    {0, "[region]\nset = \"left\"", 29, "region", "allowed: [[region]], a list of tables"},
    {0, "[[crack]]\npolygon = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]", 30, "crack.0.polygon",
     "in a body of dimension 2; allowed: segment in 2D"},
    {0, "[[crack]]\nsegment = [[0, 0], [1, 0], [1, 1]]", 30, "crack.0.segment", "found a list of 3"},
    {0, "[[crack]]\nsegment = [[0, 0], [1]]", 30, "crack.0.segment.1", "found a list of 1; allowed: a list of 2"},
    {0, "[[crack]]\nsegment = [[0, 0], [0, 0]]", 30, "crack.0.segment", "allowed: two different ends"},
    {0, "[[crack]]", 29, "crack.0", "found none of them; allowed: exactly 1 of segment, polygon"},
    {0, INTERFACE "[\"left\", \"rset\"]\ndamage = { type = \"critical_stretch\", stretch = 1 }", 36, "interface.0.between",
     "did you mean 'rest'?"},
    {0, INTERFACE "[\"left\", \"left\"]\ndamage = { type = \"critical_stretch\", stretch = 1 }", 36, "interface.0.between",
     "allowed: two different regions"},
    {0, INTERFACE "[\"left\"]\ndamage = { type = \"critical_stretch\", stretch = 1 }", 36, "interface.0.between",
     "allowed: a list of strings (exactly 2)"},
    {0, "[[interface]]\nbetween = [\"left\", \"rest\"]\ndamage = { type = \"critical_stretch\", stretch = 1 }", 29,
     "interface.0.damage", "found in a scene without [damage]"},
    // initial, boundaries, loads
    {0, "[initial]\ndisplacement = [0]", 30, "initial.displacement", "found a list of 1; allowed: a list of 2"},
    {0, "[initial]\nvelocity = [0, \"free\"]", 30, "initial.velocity.1", "unknown name 'free'"},
    {0, "[initial]\nfrom = \"nowhere/results.h5\"", 30, "initial.from", "does not exist; allowed: an existing file"},
    {0, "[initial]\nfrom = \"a.h5\"\nvelocity = [0, 0]", 29, "initial", "at most 1 of from, velocity"},
    {25, "set = \"letf\"", 25, "boundary.0.set", "did you mean 'left'?"},
    {25, "", 24, "boundary.0.set", "found nothing; allowed: a string"},
    {26, "displacement = [0]", 26, "boundary.0.displacement", "found a list of 1"},
    {26, "displacement = [0, \"fre\"]", 26, "boundary.0.displacement.1", "unknown name 'fre'"},
    {26, "displacement = [0, true]", 26, "boundary.0.displacement.1",
     "found the boolean true; allowed: a number [m], an expression in x, y, z, t"},
    {26, "displacement = [0, 0]\nvelocity = [0, 0]", 24, "boundary.0", "found displacement, velocity; allowed: exactly 1"},
    {26, "displacment = [0, 0]", 26, "boundary.0.displacment", "did you mean 'displacement'?"},
    {24, "[boundary]", 24, "boundary", "found a table; allowed: [[boundary]]"},
    {25, "face = \"+z\"", 25, "boundary.0.face", "found \"+z\" in a body of dimension 2; allowed: the axes of the body"},
    {25, "face = \"left\"", 25, "boundary.0.face", "allowed: \"+x\", \"-x\""},
    {25, "set = \"left\"\nat = 0.1", 26, "boundary.0.at", "found it without face; allowed: only with face"},
    {25, "surface = \"x - 1\"\nset = \"left\"", 25, "boundary.0.surface", "found it together with set; allowed: one of the two"},
    {25, "face = \"+x\"\nsurface = \"x - 1\"", 26, "boundary.0.surface", "found it together with face; allowed: one of the two"},
    {25, "surface = \"x - t\"", 25, "boundary.0.surface", "t is not allowed here; allowed: x, y, z, pi"},
    {25, "surface = \"x - 1\"\nat = 1.0", 26, "boundary.0.at", "found it without face; allowed: only with face"},
    {26, "displacement = [0, \"free\"]\nsurface = \"x - 1\"", 26, "boundary.0.displacement.1",
     "found \"free\" on a surface, whose normal is no axis"},
    {0, "[[symmetry]]\naxis = \"z\"", 30, "symmetry.0.axis", "found \"z\" in a body of dimension 2; allowed: the axes of the body"},
    {0, "[[symmetry]]\nat = 0.5", 29, "symmetry.0.axis", "found nothing; allowed: \"x\""},
    {0, "[[periodic]]\naxis = 1", 30, "periodic.0.axis", "found the integer 1; allowed: \"x\""},
    {0, "[periodic]\naxis = \"x\"", 29, "periodic", "found a table; allowed: [[periodic]]"},
    {0, "[[load]]\nset = \"tip\"", 29, "load.0", "found none of them; allowed: exactly 1 of force, body_force, traction"},
    {0, "[[load]]\nset = \"tip\"\nforce = [0, \"free\"]", 31, "load.0.force.1", "unknown name 'free'"},
    {0, "[[load]]\nset = \"tip\"\ntraction = [0, 1]", 29, "load.0.face", "found nothing beside traction"},
    {0, "[[load]]\nset = \"tip\"\ntraction = [0, 1]\nface = \"+z\"", 32, "load.0.face", "in a body of dimension 2"},
    {0, "[[load]]\nset = \"tip\"\ntraction = [0, 1]\nface = \"x\"", 32, "load.0.face", "allowed: \"+x\", \"-x\""},
    {0, "[[load]]\nset = \"tip\"\nforce = [0, 1]\nface = \"+x\"", 32, "load.0.face", "allowed: only with traction"},
    // output, run
    {0, "[output]\nframes = 0", 30, "output.frames", "allowed: an integer >= 1"},
    {0, "[output]\nframes = 2\nevery = 3", 29, "output", "found frames, every; allowed: at most 1"},
    {0, "[output]\ntimes = [1, 0.5]", 30, "output.times", "do not ascend"},
    {0, "[output]\nfields = [\"displacment\"]", 30, "output.fields.0", "did you mean 'displacement'?"},
    {0, "[output]\nfields = [\"damage\", \"damage\"]", 30, "output.fields.1", "twice"},
    {0, "[output]\nfields = \"damage\"", 30, "output.fields", "allowed: a list of"},
    {0, "[output]\nhistory = [{ name = \"a\", set = \"lft\", quantity = \"damage\" }]", 30, "output.history.0.set",
     "did you mean 'left'?"},
    {0, "[output]\nhistory = [{ name = \"a\", quantity = \"velocity\" }]", 30, "output.history.0.component",
     "found nothing; allowed: x, y"},
    {0, "[output]\nhistory = [{ name = \"a\", quantity = \"velocity\", component = \"z\" }]", 30, "output.history.0.component",
     "found \"z\"; allowed: x, y"},
    {0, "[output]\nhistory = [{ name = \"a\", quantity = \"damage\", component = \"x\" }]", 30, "output.history.0.component",
     "which is a scalar"},
    {0, "[output]\nhistory = [{ name = \"time\", quantity = \"damage\" }]", 30, "output.history.0.name", "found \"time\" again"},
    {0, "[output]\nhistory = [{ name = \"a,b\", quantity = \"damage\" }]", 30, "output.history.0.name", "without commas"},
    {0, "[output]\nhistory = [{ name = \"a\", quantity = \"damage\", reduce = \"avg\" }]", 30, "output.history.0.reduce",
     "allowed: \"mean\", \"sum\""},
    {0, "[run]\nthreads = 0", 30, "run.threads", "allowed: an integer >= 1"},
    {0, "[run]\nskip = 1", 30, "run.skip", "found the integer 1; allowed: true or false"},
};

std::string replaced(const Case& c) {
  std::istringstream stream{std::string(sound)};
  std::string text, line;
  for (int number = 1; std::getline(stream, line); ++number) text += (number == c.line ? c.text : line) + "\n";
  return c.line == 0 ? text + c.text + "\n" : text;
}

}  // namespace

TEST_CASE("the scene that the cases spoil is sound") {
  FakeCatalogue parts;
  CHECK(message_of([&] { parse_scene(sound, "plate.toml", parts); }).empty());
}

TEST_CASE("bad scenes are refused with line, key and reason") {
  FakeCatalogue parts;
  CHECK(std::size(cases) >= 60);
  for (const Case& c : cases) {
    const std::string message = message_of([&] { parse_scene(replaced(c), "plate.toml", parts); });
    CAPTURE(std::string(c.text));
    CAPTURE(message);
    // One of the messages has place, key and fragment together.
    std::istringstream lines{message};
    bool found = false;
    for (std::string line; std::getline(lines, line);) {
      found |= line.starts_with(fmt::format("plate.toml:{}:", c.at)) && contains(line, fmt::format(": {}: ", c.key)) &&
               contains(line, c.fragment);
    }
    CHECK(found);
  }
}

TEST_CASE("all errors are reported at once, in the order of the file") {
  FakeCatalogue parts;
  std::string text = sound;
  text.replace(text.find("spacing = 0.1"), 13, "spacing = 0.0");
  text.replace(text.find("order = 2"), 9, "order = 9");
  text.replace(text.find("\"plate\""), 7, "7      ");
  try {
    parse_scene(text, "plate.toml", parts, {{"integrator.steps=0"}, false});
    FAIL("accepted");
  } catch (const InputErrors& errors) {
    REQUIRE(errors.messages().size() == 4);
    CHECK(errors.messages()[0].starts_with("plate.toml:2:9: title"));
    CHECK(errors.messages()[1].starts_with("plate.toml:9:11: body.lattice.spacing"));
    CHECK(errors.messages()[2].starts_with("plate.toml:19:9: kinematics.order"));
    CHECK(errors.messages()[3].starts_with("command line: integrator.steps"));
  }
}

TEST_CASE("3D cracks are plane polygons, 1D bodies have none") {
  FakeCatalogue parts;
  const auto error = [&](int dimension, const std::string& crack) {
    const std::string zeros = dimension == 1 ? "[0]" : "[0, 0, 0]", ones = dimension == 1 ? "[1]" : "[1, 1, 1]";
    const std::string text = fmt::format(
        "format = 1\nkinematics = \"baqp\"\nintegrator = \"newton\"\nfamily = {{ horizon_ratio = 3 }}\n"
        "material = {{ type = \"neo_hookean\", shear_modulus = 1, bulk_modulus = 1 }}\n"
        "body = {{ dimension = {}, lattice = {{ spacing = 0.1, lower = {}, upper = {} }} }}\n[[crack]]\n{}",
        dimension, zeros, ones, crack);
    return message_of([&] { parse_scene(text, "cube.toml", parts); });
  };
  CHECK(error(3, "polygon = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]").empty());
  CHECK(contains(error(3, "polygon = [[0, 0, 0], [1, 0, 0], [1, 1, 0.5], [0, 1, 0]]"), "off the plane"));
  CHECK(contains(error(3, "polygon = [[0, 0, 0], [1, 0, 0], [2, 0, 0]]"), "vertices on one line"));
  CHECK(contains(error(3, "segment = [[0, 0, 0], [1, 0, 0]]"), "polygon in 3D"));
  CHECK(contains(error(1, "segment = [[0], [1]]"), "in a body of dimension 1"));
}
