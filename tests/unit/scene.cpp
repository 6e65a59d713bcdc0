#include "scene/scene.hpp"

#include <doctest/doctest.h>

#include <filesystem>
#include <fstream>

#include "unit/fake_catalogue.hpp"

using namespace perikit;
using namespace perikit::test;

namespace {

const char* const cook = R"toml(format = 1
title = "Cook's \"membrane\""
[constants]
w = 48.0
k = 1e-7
[body]
dimension = 2
plane = "strain"
[body.lattice]
spacing = "w/40 - 0.1"
lower = [0, "w - 48"]
upper = [48, 60]
inside = "y > x*44/w && y < 44 + x*16/w"
[sets]
left = "x < 1.1"
tip = { nearest = [48, 60] }
two = { points = [0, 5] }
"top edge" = "y > 58"
[family]
horizon_ratio = 3.015
influence = "gaussian"
[kinematics]
type = "selective"
base = { type = "baqp", order = 2 }
stabilization = { type = "silling", coefficient = 0.25 }
[material]
type = "neo_hookean"
density = 1000.0
shear_modulus = "0.8 + k*x"
bulk_modulus = 8000
[[region]]
set = "two"
material = { type = "saint_venant_kirchhoff", youngs_modulus = 1, poisson_ratio = 0.25 }
[damage]
type = "critical_stretch"
energy_release_rate = 2.7e3
no_fail = ["left", "all"]
[[crack]]
segment = [[0.0, 0.5], [0.5, 0.5]]
[initial]
displacement = ["0", "x*y"]
velocity = [0, 1.5]
[[boundary]]
set = "left"
displacement = [0, "free"]
[[boundary]]
set = "tip"
velocity = ["sin(t)", 0]
[[load]]
set = "all"
force = [0, 1.0]
[[load]]
set = "left"
traction = ["t", 0]
face = "-x"
[integrator]
type = "newton"
tolerance = 1e-9
[output]
times = [0, 0.5, 1]
fields = ["displacement", "damage"]
history = [ { name = "tip_uy", set = "tip", quantity = "displacement", component = "y", reduce = "mean" },
            { name = "pull", set = "left", quantity = "reaction", component = "x", reduce = "sum" },
            { name = "worst", quantity = "von_mises", reduce = "max" } ]
[run]
skip = false
threads = 2
)toml";

const char* const bar = R"toml(format = 1
kinematics = "conventional"
integrator = "evaluate"
[body]
dimension = 1
lattice = { spacing = 0.1, lower = [0], upper = [1] }
[family]
horizon = 0.3
[material]
type = "saint_venant_kirchhoff"
youngs_modulus = 1
poisson_ratio = 0.0
)toml";

Scene parse(const std::string& text, SceneOptions options = {}) {
  FakeCatalogue parts;
  return parse_scene(text, "folder/cook.toml", parts, options);
}

}  // namespace

TEST_CASE("a whole scene is read") {
  const Scene scene = parse(cook);
  CHECK(scene.title == "Cook's \"membrane\"");
  CHECK(scene.constants.at("w") == 48.0);
  CHECK(scene.body.space == Space::plane_strain);
  CHECK(scene.body.section == 1.0);
  CHECK(scene.body.lattice->spacing == doctest::Approx(1.1).epsilon(1e-15));
  CHECK(scene.body.lattice->lower == std::array<double, 3>{0, 0, 0});
  CHECK(scene.body.lattice->upper == std::array<double, 3>{48, 60, 0});
  CHECK((*scene.body.lattice->inside)({24, 30, 0}) == 1.0);
  CHECK(scene.sets.size() == 4);
  CHECK(scene.horizon_ratio == 3.015);
  CHECK(scene.influence->type == "gaussian");
  CHECK(scene.kinematics->values.part("base").values.integer("order") == 2);
  CHECK(scene.stabilization->values.number("coefficient") == 0.25);
  CHECK(scene.material->values.text("volumetric") == "quadratic");
  CHECK(scene.regions.at(0).material->type == "saint_venant_kirchhoff");
  CHECK(scene.no_fail == std::vector<std::string>{"left", "all"});
  CHECK(scene.cracks.at(0).vertices.at(1) == std::array<double, 3>{0.5, 0.5, 0});
  CHECK((*scene.initial_displacement.at(1))({2, 3, 0}) == 6.0);
  CHECK((*scene.initial_velocity.at(1))({}) == 1.5);
  CHECK(scene.boundaries.at(0).components.at(0)->is_number());
  CHECK(!scene.boundaries.at(0).components.at(1));
  CHECK(scene.boundaries.at(1).velocity);
  CHECK(scene.boundaries.at(1).components.at(0)->depends_on_time());
  CHECK(scene.boundaries.at(1).position.line == 48);
  CHECK(scene.loads.at(1).type == LoadDescription::Type::traction);
  CHECK(scene.loads.at(1).face == "-x");
  CHECK(scene.integrator->values.integer("steps") == 10);
  CHECK(!scene.output.frames);
  CHECK(scene.output.times == std::vector<double>{0, 0.5, 1});
  CHECK(scene.output.history.at(2).set == "all");
  CHECK(scene.output.history.at(1).reduce == "sum");
  CHECK(!scene.skip);
  CHECK(scene.threads == 2);
  CHECK(scene.text == cook);
}

TEST_CASE("names stand for parts, and defaults are filled in") {
  const Scene scene = parse(bar);
  CHECK(scene.body.space == Space::line_stress);
  CHECK(scene.body.section == 1.0);
  CHECK(scene.horizon == 0.3);
  CHECK(scene.horizon_ratio == 0.0);
  CHECK(scene.influence->type == "constant");
  CHECK(scene.kinematics->values.integer("order") == 1);
  CHECK(!scene.damage);
  CHECK(!scene.stabilization);
  CHECK(scene.output.frames == 20);
  CHECK(scene.output.fields.empty());
  CHECK(scene.skip);
  CHECK(!scene.threads);
  CHECK(parse(bar, {{"body.line=strain", "body.area=2"}, false}).body.space == Space::line_strain);
  CHECK(parse(bar, {{"body.area=2"}, false}).body.section == 2.0);
}

TEST_CASE("the resolved scene resolves to itself") {
  for (const char* text : {cook, bar}) {
    const std::string resolved = parse(text).resolved;
    CAPTURE(resolved);
    CHECK(parse(resolved).resolved == resolved);
  }
  const std::string resolved = parse(cook).resolved;
  CHECK(contains(resolved, "steps = 10\n"));
  CHECK(contains(resolved, "base = { type = \"baqp\", order = 2 }"));
  CHECK(contains(resolved, "volumetric = \"quadratic\""));
  CHECK(contains(resolved, "\"top edge\" = \"y > 58\""));
  CHECK(contains(resolved, "k = 1e-07"));
  CHECK(contains(parse(bar).resolved, "frames = 20"));
}

TEST_CASE("overrides change values, reach into lists and fall back to strings") {
  SceneOptions options;
  options.overrides = {"integrator.steps=20",
                       "boundary.0.displacement=[1, 0]",
                       "boundary.1.velocity.1 = 3",
                       "title=a plain title",
                       "kinematics.base.type=conventional",
                       "kinematics.base.order=1",
                       "body.plane=stress",
                       "run.seed=7",
                       "constants.w=50",
                       "initial.velocity=[\"w\", 0]"};
  const Scene scene = parse(cook, options);
  CHECK(scene.integrator->values.integer("steps") == 20);
  CHECK(scene.integrator->values.position("steps").file == "command line");
  CHECK((*scene.boundaries.at(0).components.at(0))({}) == 1.0);
  CHECK((*scene.boundaries.at(1).components.at(1))({}) == 3.0);
  CHECK(scene.title == "a plain title");
  CHECK(scene.kinematics->values.part("base").type == "conventional");
  CHECK(scene.body.space == Space::plane_stress);
  CHECK(scene.seed == 7);
  CHECK((*scene.initial_velocity.at(0))({}) == 50.0);
  CHECK(contains(scene.resolved, "steps = 20"));
  CHECK(parse(scene.resolved).resolved == scene.resolved);
  // A part given by its name becomes a table, a missing section is made.
  CHECK(parse(bar, {{"kinematics.order=2"}, false}).kinematics->values.integer("order") == 2);
  CHECK(parse(bar, {{"damage.type=critical_stretch", "damage.stretch=0.1"}, false}).damage->values.number("stretch") == 0.1);
}

TEST_CASE("bad overrides are reported as of the command line") {
  const auto error = [](const std::string& text) { return message_of([&] { parse(cook, {{text}, false}); }); };
  CHECK(contains(error("integrator.step=20"), "command line: integrator.step: found an unknown key"));
  CHECK(contains(error("integrator.step=20"), "did you mean 'steps'?"));
  CHECK(contains(error("integrators.steps=20"), "command line: integrators: found an unknown key"));
  CHECK(
      contains(error("integrator.steps=2.5"), "command line: integrator.steps: found the number 2.5; allowed: an integer >= 1"));
  CHECK(contains(error("boundary.2.set=left"),
                 "command line: boundary.2.set: found the index \"2\" into boundary; allowed: 0 to 1"));
  CHECK(contains(error("boundary.x.set=left"), "found the index \"x\""));
  CHECK(contains(error("boundary.0.set=lfet"), "command line: boundary.0.set: found the unknown set \"lfet\""));
  CHECK(contains(error("steps"), "command line: --set: found \"steps\"; allowed: key=value"));
  CHECK(contains(error("=3"), "allowed: key=value"));
  CHECK(contains(error("body.lattice.jitter=nan"), "command line: body.lattice.jitter: found the number nan"));
  CHECK(contains(error("..=1"), "command line: "));
}

TEST_CASE("libraries of a scene need trust") {
  FakeCatalogue parts;
  const std::string text = "plugins = [\"./libmy_law.so\"]\n" + std::string(bar);
  const std::string message = message_of([&] { parse_scene(text, "folder/bar.toml", parts); });
  CHECK(contains(
      message,
      "folder/bar.toml:1:11: plugins: found ./libmy_law.so to open; libraries that a scene lists are opened only with --trust"));
  CHECK(parts.opened.empty());
  const Scene scene = parse_scene(text, "folder/bar.toml", parts, {{}, true});
  REQUIRE(parts.opened.size() == 1);
  CHECK(parts.opened[0] == std::filesystem::absolute("folder/libmy_law.so"));
  CHECK(parse_scene(scene.resolved, "folder/bar.toml", parts, {{}, true}).resolved == scene.resolved);
  const std::string broken = message_of([&] {
    parse_scene("plugins = [\"broken.so\"]\n" + std::string(bar), "bar.toml", parts, {{}, true});
  });
  CHECK(contains(broken, "bar.toml:1:11: plugins: broken.so: not a shared library"));
}

TEST_CASE("files: relative to the scene, and clear errors") {
  FakeCatalogue parts;
  const auto folder = std::filesystem::temp_directory_path() / "perikit_scene_test";
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "cloud.csv") << "x,volume\n0,1\n";
  std::ofstream(folder / "empty.toml") << "";
  std::string text = bar;
  const std::string lattice = "lattice = { spacing = 0.1, lower = [0], upper = [1] }";
  text.replace(text.find(lattice), lattice.size(), "points = { file = \"cloud.csv\" }");
  std::ofstream(folder / "bar.toml") << text;
  std::ofstream(folder / "comment.toml") << "# nothing\n";
  std::ofstream(folder / "syntax.toml") << "format = 1\ntitle = \"open\n";

  const Scene scene = read_scene(folder / "bar.toml", parts);
  CHECK(*scene.body.points_file == folder / "cloud.csv");
  CHECK(parse_scene(scene.resolved, "elsewhere/scene.toml", parts).resolved == scene.resolved);
  const auto error = [&](const char* file) { return message_of([&] { read_scene(folder / file, parts); }); };
  CHECK(contains(error("."), "is a folder"));
  CHECK(contains(error("missing.toml"), "missing.toml: does not exist"));
  CHECK(contains(error("empty.toml"), "empty.toml: found an empty file"));
  CHECK(contains(error("comment.toml"), "found an empty file"));
  CHECK(contains(error("syntax.toml"), "syntax.toml:2:14: not valid TOML"));
  CHECK(contains(message_of([&] { read_scene("/dev/null", parts); }), "is not a regular file"));
  std::filesystem::remove_all(folder);
}

TEST_CASE("every section has a table, and every default of it is allowed") {
  bool load = false;
  for (const auto& [section, table] : scene_sections()) {
    load |= section == "load";
    for (const Parameter& parameter : table.parameters()) {
      const std::string key = section + "." + parameter.name;
      CAPTURE(key);
      CHECK(!parameter.text.empty());
      CHECK(!allowed(parameter).empty());
    }
  }
  CHECK(load);
}

TEST_CASE("run.seed is the seed of the lattice that has none of its own") {
  const std::string text = cook;
  CHECK(parse(text).body.lattice->seed == 1);
  std::string with_run = text;
  with_run.replace(with_run.find("[run]\n"), 6, "[run]\nseed = 7\n");
  const Scene scene = parse(with_run);
  CHECK(scene.body.lattice->seed == 7);
  CHECK(parse(scene.resolved).body.lattice->seed == 7);
  std::string own = with_run;
  own.replace(own.find("lower = ["), 0, "seed = 3\n");
  CHECK(parse(own).body.lattice->seed == 3);
}

TEST_CASE("constants may use others, wherever they stand") {
  std::string text = cook;
  const std::string one = "[constants]\n";
  text.replace(text.find(one), one.size(), one + "a_half = \"b/n\"\nb = \"2*c + pi - pi\"\nc = 4\nn = 16\n");
  const Scene scene = parse(text);
  CHECK(scene.constants.at("b") == doctest::Approx(8.0));
  CHECK(scene.constants.at("a_half") == doctest::Approx(0.5));
}

TEST_CASE("an expression may stand for any number and any integer, with constants or without") {
  const auto replaced = [](std::string text, const std::string& from, const std::string& to) {
    REQUIRE(text.find(from) != std::string::npos);
    return text.replace(text.find(from), from.size(), to);
  };
  std::string text = replaced(bar, "dimension = 1", "dimension = \"2 - 1\"\narea = \"1/8\"");
  text = replaced(text, "spacing = 0.1, lower = [0]", "spacing = \"1/4\", jitter = \"0.1\", seed = \"3/0.1\", lower = [\"-1/2\"]");
  text = replaced(text, "horizon = 0.3", "horizon = \"sqrt(0.25)\"");
  text += "[sets]\nfirst = { points = [\"2 - 2\"] }\nlast = { nearest = [\"1/1\"] }\n";
  text += "[output]\ntimes = [0, \"1/2\"]\nhistory_every = \"2*5\"\n[run]\nthreads = \"1 + 1\"\n";
  const Scene scene = parse(text, {.overrides = {"integrator = { type = \"newton\", steps = \"20/2\", tolerance = \"1/1024\" }", "body.lattice.upper.0=3/2"}});
  CHECK(scene.body.dimension == 1);
  CHECK(scene.body.section == 0.125);
  CHECK(scene.body.lattice->spacing == 0.25);
  CHECK(scene.body.lattice->jitter == 0.1);
  CHECK(scene.body.lattice->seed == 30);
  CHECK(scene.body.lattice->lower[0] == -0.5);
  CHECK(scene.body.lattice->upper[0] == 1.5);
  CHECK(scene.horizon == 0.5);
  CHECK(scene.sets[0].points == std::vector<std::int64_t>{0});
  CHECK(*scene.sets[1].nearest == std::array<double, 3>{1, 0, 0});
  CHECK(scene.output.times == std::vector<double>{0, 0.5});
  CHECK(scene.output.history_every == 10);
  CHECK(scene.threads == 2);
  CHECK(scene.integrator->values.integer("steps") == 10);
  CHECK(scene.integrator->values.number("tolerance") == 1.0 / 1024);
  CHECK(parse(std::string(bar) + "[constants]\na = \"1/4\"\nb = \"2\"\n").constants == Constants{{"a", 0.25}, {"b", 2.0}});
}

TEST_CASE("values without t ramp in quasi-static runs unless the scene says otherwise") {
  std::string text = cook;
  const std::string load = "force = [0, 1.0]\n", timed = "traction = [\"t\", 0]\n";
  text.replace(text.find(load), load.size(), load + "ramp = false\n");
  const Scene scene = parse(text);
  CHECK(scene.loads.at(0).ramp.given == false);
  CHECK(!scene.loads.at(1).ramp.given);
  text.replace(text.find(timed), timed.size(), timed + "ramp = true\n");
  CHECK_THROWS_WITH_AS(parse(text), doctest::Contains("load.1.ramp: found true with a value that mentions t"), InputError);
}
