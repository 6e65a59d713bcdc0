#include "study/study.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <iterator>

#include "study/axes.hpp"
#include "tests/kit/registry.hpp"
#include "tests/kit/scene_text.hpp"
#include "unit/fake_catalogue.hpp"
#include "unit/temporary_folder.hpp"

using namespace perikit;
using namespace perikit::test;
namespace fs = std::filesystem;

namespace {

const std::string scene_text = SceneText{.dimension = 1, .space = "", .constants = "k = 2.0", .upper = {4}, .family = "horizon_ratio = 2", .kinematics = "conventional",
                                         .material = "type = \"saint_venant_kirchhoff\"\ndensity = 1.0\nyoungs_modulus = 1.0\npoisson_ratio = 0.25",
                                         .integrator = "type = \"verlet\"\nend_time = 1.0"};

const std::string study_text = R"(format = 1
title = "A study"
scene = "scene.toml"
[values]
kinematics.type = ["conventional", "baqp"]
constants.k = [1, 2, 4]
[[quantity]]
name = "top"
from = "time"
reduce = "max"
reference = "2 * k"
[[quantity]]
name = "cost"
from = "run_time"
)";

struct StudyFolder : TemporaryFolder {
  FakeCatalogue parts;
  StudyFolder() { std::ofstream(path / "scene.toml") << scene_text; }
  Study parse(const std::string& text) { return parse_study(text, path / "study.toml", parts); }
  std::string error(const std::string& text) {
    std::string message = message_of([&] { parse(text); });
    const std::string prefix = (path / "").string();
    for (std::size_t at; (at = message.find(prefix)) != std::string::npos;) message.erase(at, prefix.size());
    return message;
  }
};

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

std::string content(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// A run without physics: its history holds k in the middle.
RunOutcome pretend(const Scene& scene, const fs::path& folder) {
  const double k = scene.constants.at("k");
  if (k == 4 && scene.kinematics->type == "baqp") return {"failed", "det F < 0 at point 3, \"x\" = 1", {}};
  fs::create_directories(folder);
  std::ofstream(folder / "scene.toml") << scene.resolved;
  std::ofstream(folder / "history.csv") << "step,time\n0,0\n1," << 1.5 * k << "\n2," << k << '\n';
  return {"done", "", {{"run_time", 0.25}}};
}

void silent(const std::string&) {}

}  // namespace

TEST_CASE("grid: the first key of the file is the slowest; zip: the lists side by side") {
  StudyFolder folder;
  const Study grid = folder.parse(study_text);
  REQUIRE(grid.keys.size() == 2);
  CHECK(grid.keys[0].key == "kinematics.type");
  CHECK(grid.keys[1].key == "constants.k");
  using Lists = std::vector<std::vector<std::size_t>>;
  CHECK(combinations(grid) == Lists{{0, 0}, {0, 1}, {0, 2}, {1, 0}, {1, 1}, {1, 2}});
  const std::string pairs = replaced(replaced(study_text, "[1, 2, 4]", "[1, 2]"), "[values]", "mode = \"zip\"\n[values]");
  CHECK(combinations(folder.parse(pairs)) == Lists{{0, 0}, {1, 1}});
}

TEST_CASE("values may be anything that a scene takes; quoted keys mean the same as dotted ones") {
  StudyFolder folder;
  const Study study =
      folder.parse(replaced(study_text, "kinematics.type = [\"conventional\", \"baqp\"]",
                            "\"kinematics\" = [{ type = \"baqp\", order = 2 }, \"a \\\"b\\\"\", [1, 2.5], true, 1e-30]"));
  const auto& values = study.keys[0].values;
  REQUIRE(values.size() == 5);
  CHECK(values[0].toml == "{ order = 2, type = \"baqp\" }");
  CHECK(values[1].toml == "\"a \\\"b\\\"\"");
  CHECK(values[1].shown == "a \"b\"");
  CHECK(values[2].toml == "[1, 2.5]");
  CHECK(values[3].toml == "true");
  CHECK(values[4].number == 1e-30);
  CHECK_FALSE(values[2].number.has_value());
  CHECK(folder.parse(replaced(study_text, "kinematics.type", "\"kinematics.type\"")).keys[0].key == "kinematics.type");
}

TEST_CASE("errors of a study file name place, key, what was found and what is allowed") {
  StudyFolder folder;
  const auto check = [&](const std::string& from, const std::string& to, const std::string& expected) {
    const std::string message = folder.error(replaced(study_text, from, to));
    CHECK_MESSAGE(contains(message, expected), message);
  };
  check("format = 1", "format = 2", "study.toml:1:10: format: found the integer 2; allowed: an integer >= 1 and <= 1");
  check("title", "titel",
        "study.toml:2:1: titel: found an unknown key; allowed: values, quantity, plot, format, title, scene, mode; did you mean "
        "'title'?");
  check("scene.toml", "missing.toml",
        "study.toml:3:9: scene: found \"missing.toml\", but missing.toml is no file; allowed: a scene file");
  check("[values]", "mode = \"cross\"\n[values]",
        "study.toml:4:8: mode: found the string \"cross\"; allowed: \"grid\" or \"zip\"");
  check("[values]", "mode = \"zip\"\n[values]",
        "study.toml:7:15: values.constants.k: found a list of 3; allowed with mode = \"zip\": 2, as many as kinematics.type has");
  check("[1, 2, 4]", "3", "study.toml:6:15: values.constants.k: found the integer 3; allowed: a list of values, at least one");
  check("[1, 2, 4]", "[]", "values.constants.k: found a list of 0; allowed: a list of values, at least one");
  check("[1, 2, 4]", "[1979-05-27]",
        "values.constants.k.0: found a date or time; allowed: a number, boolean, string, list or table");
  std::string many;
  for (int k = 0; k < 800; ++k) many += "1, ";
  check("constants.k = [1, 2, 4]", "constants.k = [" + many + "]\nconstants.l = [" + many + "]",
        "study.toml:4:1: values: found 1.28e+06 combinations; allowed: at most 1000000 runs");
  check("constants.k = [1, 2, 4]", "\"kinematics.type\" = [\"baqp\"]", "found the key twice; allowed: once");
  check("\"max\"", "\"sum\"",
        "study.toml:10:10: quantity.0.reduce: found the string \"sum\"; allowed: \"last\", \"max\", \"min\" or \"mean\"");
  check("\"2 * k\"", "0.0", "study.toml:11:13: quantity.0.reference: found the number 0.0; allowed: a number other than zero");
  check("name = \"cost\"", "name = \"top\"", "study.toml:13:8: quantity.1.name: found \"top\"; allowed: a name of its own");
  check("name = \"cost\"", "name = \"constants.k\"", "quantity.1.name: found \"constants.k\"; allowed: a name of its own");
  const std::string plot = "\n[plot]\nx = \"cots\"\ny = \"top_error\"\nseries = \"k\"\nlog = \"z\"\n";
  check("from = \"run_time\"\n", "from = \"run_time\"\n" + plot,
        "plot.x: found \"cots\"; allowed: kinematics.type, constants.k, top, top_error, cost; did you mean 'cost'?");
  check("from = \"run_time\"\n", "from = \"run_time\"\n" + plot,
        "plot.series: found \"k\"; allowed: kinematics.type, constants.k");
  check("from = \"run_time\"\n", "from = \"run_time\"\n" + plot, "plot.log: found the string \"z\"");
  CHECK(contains(folder.error("format = 1\nscene = \"scene.toml\"\n"), "values: found nothing; allowed: a table of scene keys"));
  CHECK(contains(folder.error("format = 1\nscene = \"scene.toml\"\n"), "quantity: found nothing; allowed: [[quantity]]"));
  CHECK(contains(folder.error("format = 1\n[body]\ndimension = 1\n"), "study.toml:2:2: body: found a scene: `perikit run study.toml -o DIR` runs it"));
  CHECK(contains(folder.error("format = "), "study.toml:1:10: not valid TOML"));
  CHECK(contains(message_of([&] { read_study(folder.path / "absent.toml", folder.parts); }), "absent.toml: does not exist"));
}

TEST_CASE("a quantity or reference that does not fit the scene is refused before the first run") {
  StudyFolder folder;
  const auto check = [&](const std::string& from, const std::string& to, const std::string& expected) {
    const Study study = folder.parse(replaced(study_text, from, to));
    bool ran = false;
    const auto run = [&](const Scene&, const fs::path&) { return ran = true, RunOutcome{}; };
    const std::string message = message_of([&] { run_study(study, folder.parts, {}, folder.path / "out", run, silent); });
    CHECK_MESSAGE(contains(message, expected), message);
    CHECK_FALSE(ran);
  };
  check("\"time\"", "\"tiem\"", "study.toml:9:8: quantity.0.from: found \"tiem\"; allowed: step, time, time_step,");
  check("\"time\"", "\"tiem\"", "run_time, cpu_time, set_up_time, steps, points, bonds, memory; did you mean 'time'?");
  check("2 * k", "2 * kk", "study.toml:11:13: quantity.0.reference: found the expression \"2 * kk\": unknown name 'kk'");
  check("2 * k", "2 * x", "quantity.0.reference: found an expression in x, y or z; allowed: one in the constants of the scene");
  check("2 * k", "k - 2", "quantity.0.reference: found the value 0; allowed: any other");
  check("kinematics.type = [\"conventional\", \"baqp\"]", "kinematics.typ = [1, 2]",
        "values: none of the 6 combinations makes a scene; the first: ");
}

TEST_CASE("the table holds values, quantities, errors and what went wrong; a failed run does not stop the study") {
  StudyFolder folder;
  const Study study = folder.parse(replaced(study_text, "\"baqp\"]", "\"baqp\", \"bapq\"]"));
  std::vector<std::string> lines;
  const StudyTable table =
      run_study(study, folder.parts, {}, folder.path / "out", pretend, [&](const std::string& line) { lines.push_back(line); });
  REQUIRE(table.rows.size() == 9);
  CHECK(lines.size() == 18);
  CHECK(lines[0] == "run 1 of 9 (runs/0): kinematics.type = \"conventional\", constants.k = 1");
  CHECK(table.number(table.rows[2], "constants.k") == 4);
  CHECK(table.number(table.rows[2], "top") == 6);           // max: 1.5 k
  CHECK(table.number(table.rows[2], "top_error") == 0.25);  // against 2 k
  CHECK(table.number(table.rows[2], "cost") == 0.25);
  CHECK_FALSE(table.number(table.rows[2], "kinematics.type").has_value());
  CHECK(table.rows[5].status == "failed");
  CHECK_FALSE(table.number(table.rows[5], "top").has_value());
  CHECK(table.rows[6].status == "refused");
  CHECK(
      contains(table.rows[6].reason, "study.toml:5:19: values.kinematics.type: found the unknown kinematics 'bapq'; allowed: "));
  const std::string csv = content(folder.path / "out" / "table.csv");
  CHECK(csv.starts_with(
      "run,kinematics.type,constants.k,top,top_error,cost,status,reason\n0,conventional,1,1.5,0.25,0.25,done,\n"));
  CHECK(contains(csv, "5,baqp,4,,,,failed,\"det F < 0 at point 3, \"\"x\"\" = 1\"\n"));
  CHECK(contains(content(folder.path / "out" / "table.md"), "| 2 | conventional | 4 | 6 | 0.25 | 0.25 | done |  |\n"));
  CHECK(fs::exists(folder.path / "out" / "runs" / "4" / "history.csv"));
}

TEST_CASE("values that are expressions are numbers in the table and the picture") {
  StudyFolder folder;
  const std::string text = replaced(study_text, "constants.k = [1, 2, 4]", "body.lattice.spacing = [1, \"k/4\", \"1/8\"]");
  const StudyTable table = run_study(folder.parse(text), folder.parts, {}, folder.path / "out", pretend, silent);
  std::vector<double> spacings;
  for (const StudyRow& row : table.rows) spacings.push_back(table.number(row, "body.lattice.spacing").value_or(-1));
  CHECK(spacings == std::vector<double>{1, 0.5, 0.125, 1, 0.5, 0.125});
  CHECK(!table.number(table.rows[0], "kinematics.type"));
}

TEST_CASE("runs side by side give the table of runs one by one") {
  StudyFolder folder;
  const Study study = folder.parse(replaced(study_text, "\"baqp\"]", "\"baqp\", \"bapq\"]"));
  const std::string expected = run_study(study, folder.parts, {}, folder.path / "one", pretend, silent).csv();
  for (const int jobs : {2, 20}) {
    const fs::path out = folder.path / fmt::format("side{}", jobs);
    CHECK(run_study(study, folder.parts, {}, out, pretend, silent, {jobs, false}).csv() == expected);
    CHECK(content(out / "table.csv") == expected);
  }
  // A process that dies takes its own run with it alone.
  const auto dies = [](const Scene& scene, const fs::path& own) -> RunOutcome {
    if (scene.constants.at("k") == 2) std::_Exit(3);
    return pretend(scene, own);
  };
  const StudyTable table = run_study(study, folder.parts, {}, folder.path / "dies", dies, silent, {3, false});
  CHECK(table.rows[1].status == "failed");
  CHECK(contains(table.rows[1].reason, "left no outcome"));
  CHECK(table.rows[0].status == "done");
}

TEST_CASE("a study goes on where it was stopped: what is done is kept, what failed or changed runs again") {
  StudyFolder folder;
  const fs::path out = folder.path / "out";
  const Study study = folder.parse(study_text);
  const std::string first = run_study(study, folder.parts, {}, out, pretend, silent).csv();
  std::vector<double> again;
  const auto counted = [&](const Scene& scene, const fs::path& own) {
    again.push_back(scene.constants.at("k"));
    return pretend(scene, own);
  };
  fs::remove_all(out / "runs" / "1");
  CHECK(run_study(study, folder.parts, {}, out, counted, silent, {1, true}).csv() == first);
  CHECK(again == std::vector<double>{2, 4});   // the one that is gone, and the one that failed
  again.clear();
  CHECK(run_study(study, folder.parts, {{"title=\"another\""}, false}, out, counted, silent, {1, true}).csv() == first);
  CHECK(again.size() == 6);
  again.clear();
  run_study(study, folder.parts, {{"title=\"another\""}, false}, out, counted, silent);
  CHECK(again.size() == 6);
}

TEST_CASE("reductions over the history") {
  StudyFolder folder;
  const auto top = [&](const std::string& reduce) {
    const Study study = folder.parse(replaced(study_text, "\"max\"", '"' + reduce + '"'));
    return *run_study(study, folder.parts, {}, folder.path / "out", pretend, silent).rows[1].quantities[0];
  };
  CHECK(top("last") == 2.0);
  CHECK(top("max") == 3.0);
  CHECK(top("min") == 0.0);
  CHECK(top("mean") == doctest::Approx(5.0 / 3.0).epsilon(1e-15));
}

TEST_CASE("a logarithmic axis has labelled tics, also where it covers less than a decade") {
  for (const auto& ends : {std::pair{0.398, 0.492}, {0.005, 0.02}, {0.9, 1.1}, {1e-9, 9e-8}, {3.0, 3.001}}) {
    const double least = ends.first, most = ends.second;
    const std::vector<double> tics = logarithmic_tics(least, most);
    const auto shown = std::ranges::count_if(tics, [&](double tic) { return tic >= least && tic <= most; });
    CHECK_MESSAGE((shown >= 2 && shown <= 8), shown, " tics from ", least, " to ", most);
    CHECK(std::ranges::is_sorted(tics));
  }
  CHECK(logarithmic_tics(1e-3, 1.0).empty());   // every decade
  CHECK(logarithmic_tics(2.0, 2.0).empty());
}

TEST_CASE("the picture has a line for each value of the series" *
          doctest::skip(std::system("gnuplot --version > /dev/null 2>&1") != 0)) {
  StudyFolder folder;
  const Study study =
      folder.parse(study_text + "[plot]\nx = \"cost\"\ny = \"top_error\"\nseries = \"kinematics.type\"\nlog = \"xy\"\n");
  run_study(study, folder.parts, {}, folder.path / "out", pretend, silent);
  CHECK(content(folder.path / "out" / "plot.png").starts_with("\x89PNG"));
  const std::string vector = content(folder.path / "out" / "plot.svg");
  for (const std::string word : {"<svg", "relative error of top", "cost [s]"}) CHECK_MESSAGE(contains(vector, word), "no ", word);
  // The order of the list does not matter where the axis is a key.
  const std::string drawn = "[plot]\nx = \"constants.k\"\ny = \"top\"\nseries = \"kinematics.type\"\n";
  run_study(folder.parse(study_text + drawn), folder.parts, {}, folder.path / "sorted", pretend, silent);
  run_study(folder.parse(replaced(study_text, "[1, 2, 4]", "[4, 1, 2]") + drawn), folder.parts, {}, folder.path / "other", pretend, silent);
  CHECK(content(folder.path / "sorted" / "plot.svg") == content(folder.path / "other" / "plot.svg"));
  // Names that are wide stand below each other, each whole, and the picture grows by as much.
  const std::string wide = "title = [\"all of the points of the body at rest, and one that moves under its weight\", \"one of the points of the body at rest, and all others move under their weight\"]";
  run_study(folder.parse(replaced(study_text, "kinematics.type = [\"conventional\", \"baqp\"]", wide) + replaced(drawn, "kinematics.type", "title")), folder.parts, {}, folder.path / "wide",
            pretend, silent);
  const std::string picture = content(folder.path / "wide" / "plot.svg");
  CHECK_MESSAGE(contains(picture, "height=\"790\""), picture.substr(0, 400));
  const auto unmeasured = [](const Scene& scene, const fs::path& own) {
    RunOutcome outcome = pretend(scene, own);
    outcome.measures.clear();
    return outcome;
  };
  CHECK(contains(message_of([&] { run_study(study, folder.parts, {}, folder.path / "none", unmeasured, silent); }),
                 "no run gives numbers for cost and top_error"));
}

TEST_CASE("runs that are not done are told by name, and missing in the picture by series" *
          doctest::skip(std::system("gnuplot --version > /dev/null 2>&1") != 0)) {
  StudyFolder folder;
  const std::string text = replaced(study_text, "\"baqp\"]", "\"baqp\", \"bapq\"]") + "[plot]\nx = \"constants.k\"\ny = \"top\"\nseries = \"kinematics.type\"\n";
  const StudyTable table = run_study(folder.parse(text), folder.parts, {}, folder.path / "out", pretend, silent);
  const std::string told = unfinished_runs(table);
  CHECK(told.starts_with("4 of 9 runs of the study did not come to their end:\n  runs/5 (kinematics.type = \"baqp\", constants.k = 4) failed: det F < 0 at point 3"));
  CHECK(contains(told, "\n  runs/8 (kinematics.type = \"bapq\", constants.k = 4) refused: "));
  const std::string picture = content(folder.path / "out" / "plot.svg");
  for (const std::string word : {">conventional<", ">baqp (1 failed)<", ">bapq (no point: 3 refused)<"}) CHECK_MESSAGE(contains(picture, word), word);
  CHECK(unfinished_runs(run_study(folder.parse(replaced(study_text, "[1, 2, 4]", "[1, 2]")), folder.parts, {}, folder.path / "good", pretend, silent)).empty());
}

TEST_CASE("a line for each combination of the series, and over a key of all others" * doctest::skip(std::system("gnuplot --version > /dev/null 2>&1") != 0)) {
  StudyFolder folder;
  const std::string values = replaced(study_text, "constants.k = [1, 2, 4]", "constants.k = [1, 2]\nbody.lattice.spacing = [1.0, 0.5]");
  const auto picture = [&](const std::string& plot) {
    run_study(folder.parse(values + "[plot]\n" + plot), folder.parts, {}, folder.path / "out", pretend, silent, {.force = true});
    return content(folder.path / "out" / "plot.svg");
  };
  const std::string over_a_key = picture("x = \"constants.k\"\ny = \"top\"\nseries = \"kinematics.type\"\n");
  for (const std::string word : {">kinematics.type, body.lattice.spacing<", ">conventional, 1.0<", ">conventional, 0.5<", ">baqp, 1.0<", ">baqp, 0.5<"})
    CHECK_MESSAGE(contains(over_a_key, word), word);
  const std::string of_results = picture("x = \"cost\"\ny = \"top\"\nseries = \"kinematics.type, body.lattice.spacing\"\n");
  CHECK(contains(of_results, ">baqp, 0.5<"));
  CHECK(!contains(picture("x = \"cost\"\ny = \"top\"\nseries = \"kinematics.type\"\n"), ">baqp, 0.5<"));
  CHECK(contains(folder.error(values + "[plot]\nx = \"cost\"\ny = \"top\"\nseries = \"kinematics.type, spacing\"\n"), "plot.series: found \"spacing\"; allowed: kinematics.type"));
}

TEST_CASE("where a series stays below a level: the last point above it counts, straight lines (of logarithms) lie between points") {
  using PointSet = std::vector<std::pair<double, double>>;
  using enum Crossing::Kind;
  const auto found = [](PointSet points, bool logarithmic) { return crossing(std::move(points), 0.01, logarithmic); };
  CHECK(found({{1, 0.1}, {10, 0.001}}, true).x == doctest::Approx(std::sqrt(10.0)).epsilon(1e-12));
  CHECK(found({{10, 0.0}, {1, 0.02}}, false).x == doctest::Approx(5.5).epsilon(1e-12));
  // An error that passes through zero on its way is not small for good.
  CHECK(found({{1, 0.1}, {2, 1e-6}, {4, 0.04}, {16, 0.0025}}, true).x == doctest::Approx(8).epsilon(1e-12));
  CHECK(found({{1, 0.1}}, true).kind == never);
  CHECK(found({{3, 0.001}, {2, 0.01}}, true).kind == at_once);
  CHECK(found({{3, 0.001}, {2, 0.01}}, true).x == 2);
}

TEST_CASE("a study with a level tells it in its table, and refuses one that a logarithmic axis does not have") {
  StudyFolder folder;
  const std::string plot = "[plot]\nx = \"constants.k\"\ny = \"top_error\"\nlog = \"xy\"\n";
  // top = 1.5 k against 2 k: an error of a quarter everywhere.
  const auto table = [&](const std::string& level) {
    const Study study = folder.parse(study_text + plot + "level = " + level + "\n");
    return run_study(study, folder.parts, {}, folder.path / "out", pretend, silent).markdown();
  };
  CHECK(contains(table("0.3"), "| kinematics.type | constants.k from which top_error stays below 0.3 |\n| --- | --- |\n| conventional | < 1 |\n| baqp | < 1 |\n"));
  CHECK(contains(table("0.2"), "| conventional | > 4 |\n"));
  CHECK(contains(folder.error(study_text + plot + "level = 0\n"), "plot.level: found 0; allowed with a logarithmic axis: a number > 0"));
}

TEST_CASE("a run in a process of its own: its measures come back, its end is told") {
  StudyFolder folder;
  Registry& registry = all_parts();
  const Scene scene = read_scene(folder.path / "scene.toml", registry, {{"integrator.time_step=0.1", "run.threads=1"}, false});
  const RunOutcome outcome = run_in_child(scene, registry, folder.path / "run");
  CHECK_MESSAGE(outcome.status == "done", outcome.reason);
  CHECK(outcome.measures.at("points") == 4);
  CHECK(outcome.measures.at("steps") == 10);
  CHECK(outcome.measures.at("run_time") > 0);
  CHECK(outcome.measures.size() == run_measures().size());
  CHECK(fs::exists(folder.path / "run" / "results.h5"));
  std::ofstream(folder.path / "file") << "no folder";
  const RunOutcome failed = run_in_child(scene, registry, folder.path / "file" / "run");
  CHECK(failed.status == "failed");
  CHECK(contains(failed.reason, "file"));
}

TEST_CASE("zero_energy.toml: the conventional gradient does not see the shortest wave, bond-level ones do") {
  const TemporaryFolder folder;
  Registry& registry = all_parts();
  const Study study = read_study(fs::path(PERIKIT_SOURCE_FOLDER) / "configs/studies/zero_energy.toml", registry);
  const auto run = [&](const Scene& scene, const fs::path& own) { return run_here(scene, registry, own); };
  const StudyTable table = run_study(study, registry, {}, folder.path, run, silent);
  const double exact = 2.0e11 * 1.0e-12 * 9.869604401089358 / 4;
  for (const StudyRow& row : table.rows) {
    CAPTURE(row.values[0].shown);
    CAPTURE(row.values[1].shown);
    REQUIRE_MESSAGE(row.status == "done", row.reason);
    if (row.values[1].number == 1) CHECK(*row.errors[0] < 2e-3);  // one half wave over 33 horizons
    if (row.values[1].number != 99) continue;
    if (row.values[0].shown == "conventional") CHECK(*row.quantities[0] < 1e-4 * exact);
    if (row.values[0].shown == "baqp" || row.values[0].shown == "projection") CHECK(*row.quantities[0] > 0.1 * exact);
  }
}

TEST_CASE("a study tells the observed orders of its errors, along each key and with the others held") {
  StudyFolder folder;
  StudyTable table{folder.parse(study_text), {}};
  for (const char* law : {"\"conventional\"", "\"baqp\""})
    for (const double k : {4.0, 1.0, 2.0}) {
      const double error = std::string(law) == "\"baqp\"" ? 3 * k * k : 0.5 / k;
      table.rows.push_back({table.rows.size(),
                            {{law, law, std::nullopt}, {std::to_string(k), std::to_string(static_cast<int>(k)), k}},
                            {1.0, 1.0},
                            {error, std::nullopt},
                            "done",
                            ""});
    }
  const std::string text = table.markdown();
  CHECK(contains(text, "| top_error | kinematics.type = \"baqp\" | constants.k | 1 | 2 | 2.00 |"));
  CHECK(contains(text, "| top_error | kinematics.type = \"baqp\" | constants.k | 2 | 4 | 2.00 |"));
  CHECK(contains(text, "| top_error | kinematics.type = \"conventional\" | constants.k | 1 | 2 | -1.00 |"));
  table.rows.resize(1);
  CHECK(!contains(table.markdown(), "observed order"));
}
