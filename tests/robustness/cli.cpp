/// The program as a user meets it: exit statuses, messages, the files of a run, and what is left when a run is killed or fails.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <set>
#include <thread>

#include "output/recorder.hpp"
#include "robustness/desk.hpp"
#include "tests/kit/scene_text.hpp"

using namespace perikit::test;

TEST_CASE("cli: exit status 0 for what is done, 2 for what is refused") {
  const Desk desk;
  CHECK(desk.perikit("--help").status == 0);
  CHECK(desk.perikit("--version").status == 0);
  CHECK(desk.perikit("check scene.toml").status == 0);
  for (const std::string refused : {"", "walk scene.toml", "run", "run nowhere.toml", "run scene.toml --threads 0", "run scene.toml --unknown", "check scene.toml --set",
                              "describe material", "describe material/rubber", "describe matter/rubber", "list matter"}) {
    const Result result = desk.perikit(refused);
    CHECK_MESSAGE(result.status == 2, "perikit ", refused, ": status ", result.status);
    CHECK_MESSAGE(!result.err.empty(), "perikit ", refused, ": no message");
  }
  CHECK(contains(desk.perikit("run nowhere.toml").err, "nowhere.toml"));
}

TEST_CASE("cli: what was meant by a misspelt command, kind or name") {
  const Desk desk;
  const auto said = [&](const std::string& arguments, const std::string& word) {
    const Result result = desk.perikit(arguments);
    CHECK(result.status == 2);
    CHECK_MESSAGE(contains(result.err, word), "perikit ", arguments, ": no '", word, "' in\n", result.err);
  };
  said("", "Subcommands:");
  said("new influence memory --history", "--history: found the kind 'influence'; allowed: material");
  said("rnu scene.toml", "unknown command 'rnu'; allowed: run, check, study, plot, bench, new, contract, list, describe; did you mean 'run'?");
  said("run", "scene is required\nHelp: perikit run --help");
  said("run scene.toml --sett a=1", "Help: perikit run --help");
  said("list materials", "did you mean 'material'?");
  said("describe neo_hookean", "did you mean material/neo_hookean");
  said("describe material/neo", "did you mean 'neo_hookean'?");
  said("describe study/quantitiy", "did you mean 'quantity'?");
  said("run scene.toml --set kinematics.type=my_own_idea", "unknown kinematics 'my_own_idea'; allowed: baqp, ");
  said("run scene.toml --set kinematics.type=my_own_idea", "; parts in other folders: --plugin-path, PERIKIT_PLUGIN_PATH");
  said("run scene.toml --plugin-path nowhere", "nowhere: this plugin folder cannot be read: No such file or directory");
  said("study nowhere.toml", "nowhere.toml: does not exist; allowed: a readable study file");
  said("plot nowhere", "nowhere: cannot be read: No such file or directory");
  said("contract nowhere.so", "nowhere.so: this library is refused: no such file");
  said("new materials my_law", "no template for kind 'materials'; did you mean 'material'?");
}

TEST_CASE("cli: errors name file, line, column, key and what was meant") {
  struct Fault {
    std::string from, to;
    std::vector<std::string> words;
  };
  const std::vector<Fault> faults{
      {"spacing = 1.0", "spacing = -1.0", {"scene.toml:8:", "body.lattice.spacing", "-1", "> 0"}},
      {"horizon_ratio = 2.015", "horizon_ratoi = 2.015", {"scene.toml:17:1", "horizon_ratoi", "did you mean 'horizon_ratio'"}},
      {"\"neo_hookean\"", "\"neo_hokean\"", {"scene.toml:23:", "neo_hokean", "did you mean 'neo_hookean'"}},
      {"bulk_modulus = 2.0", "bulk_modulus = \"2.0 + q\"", {"scene.toml:26:", "material.bulk_modulus"}},
      {"set = \"right\"\nvelocity", "set = \"rihgt\"\nvelocity", {"scene.toml:32:", "rihgt", "did you mean 'right'"}},
      {"density = 1.0\n", "", {"scene.toml:", "density"}},
      {"frames = 5", "frames = five", {"scene.toml:41:"}},
  };
  for (const Fault& fault : faults) {
    const Desk desk(replaced(plate, fault.from, fault.to));
    for (const std::string command : {"check scene.toml", "run scene.toml -o out"}) {
      const Result result = desk.perikit(command);
      INFO(fault.to, "\n", result.err);
      CHECK(result.status == 2);
      for (const std::string& word : fault.words) CHECK_MESSAGE(contains(result.err, word), "no '", word, "'");
      CHECK_MESSAGE(!fs::exists(desk.path("out")), "a refused scene leaves a folder");
    }
  }
  // A study in place of a scene, and the other way round.
  const Desk study;
  study.write("study.toml", "format = 1\nscene = \"scene.toml\"\n[values]\nkinematics.type = [\"baqp\"]\n[[quantity]]\nname = \"cost\"\nfrom = \"run_time\"\n");
  for (const std::string command : {"check study.toml", "run study.toml -o out"}) {
    const Result result = study.perikit(command);
    CHECK(result.status == 2);
    CHECK_MESSAGE(contains(result.err, "study.toml:2:1: scene: found a study, which runs a scene over lists of values: `perikit study study.toml -o DIR` runs it"), result.err);
    CHECK(lines(result.err).size() == 1);
  }
  // All of them at once.
  const Result both = Desk(replaced(replaced(plate, "spacing = 1.0", "spacing = -1.0"), "horizon_ratio", "horizon_ratoi")).perikit("check scene.toml");
  CHECK(contains(both.err, "scene.toml:8:"));
  CHECK(contains(both.err, "scene.toml:17:"));
}

TEST_CASE("cli: list and describe show every part") {
  const Desk desk;
  const std::string all = desk.perikit("list").out;
  std::size_t parts = 0;
  for (const std::string kind : {"kinematics", "material", "damage", "influence", "integrator"}) {
    CHECK(contains(all, kind + "\n"));
    const Result list = desk.perikit(fmt::format("list {}", kind));
    CHECK(list.status == 0);
    for (const std::string& line : lines(list.out)) {
      const std::string part = line.substr(0, line.find(' '));
      CHECK(contains(all, part));
      const Result described = desk.perikit(fmt::format("describe {}/{}", kind, part));
      CHECK(described.status == 0);
      for (const std::string section : {"Equations", "Source", "Limits", "Example"}) CHECK_MESSAGE(contains(described.out, section), kind, "/", part, ": no ", section);
      ++parts;
    }
  }
  CHECK(parts >= 10);
  const std::string rubber = desk.perikit("describe material/neo_hookean").out;
  for (const std::string word : {"shear_modulus", "[Pa]", "density", "kg/m^3", "volumetric", "Default"}) CHECK_MESSAGE(contains(rubber, word), "no ", word);
}

TEST_CASE("cli: describe shows the keys of the scene and the whole reference") {
  const Desk desk;
  CHECK(contains(desk.perikit("describe scene/output").out, "checkpoint_every"));
  CHECK(!contains(desk.perikit("describe scene/output").out, "horizon_ratio"));
  CHECK(contains(desk.perikit("describe scene").out, "horizon_ratio"));
  const Result unknown = desk.perikit("describe scene/ouput");
  CHECK(unknown.status == 2);
  CHECK(contains(unknown.err, "did you mean 'output'"));
  CHECK(desk.perikit("describe").status == 2);
  const std::string study = desk.perikit("describe study").out;
  for (const std::string word : {"[top level]", "[quantity]", "[plot]", "reduce", "run_time", "reference"}) CHECK_MESSAGE(contains(study, word), "no ", word);
  const std::string page = desk.perikit("describe --markdown").out;
  for (const std::string& line : lines(desk.perikit("list material").out)) CHECK(contains(page, "### material/" + line.substr(0, line.find(' ')) + "\n"));
  CHECK(contains(page, "| `checkpoint_every` |"));
}

TEST_CASE("cli: libraries that a scene lists are opened with --trust alone") {
  const Desk desk(replaced(replaced(plate, "format = 1", fmt::format("format = 1\nplugins = [\"{}/company.so\"]", PERIKIT_LIES)),
                           "horizon_ratio = 2.015", "horizon_ratio = 2.015\ninfluence = \"company\""));
  const Result refused = desk.perikit("run scene.toml --quiet -o out");
  CHECK(refused.status == 2);
  CHECK_MESSAGE(contains(refused.err, "opened only with --trust"), refused.err);
  CHECK(!fs::exists(desk.path("out")));
  const Result run = desk.perikit("run scene.toml --quiet -o out --trust");
  CHECK_MESSAGE(run.status == 0, run.err);
}

TEST_CASE("cli: check prints a scene that is the same when read again") {
  const Desk desk;
  const Result first = desk.perikit("check scene.toml --set integrator.end_time=0.5");
  REQUIRE(first.status == 0);
  for (const std::string word : {"# points        40", "# bonds", "# memory", "# integration   verlet: 25 steps of 0.02 s"}) CHECK_MESSAGE(contains(first.out, word), "no '", word, "' in\n", first.out);
  desk.write("resolved.toml", first.out);
  const Result again = desk.perikit("check resolved.toml");
  CHECK(again.status == 0);
  // But for time and memory, the last two lines, which are measured.
  const auto without_measures = [](std::string text) {
    const std::size_t line = text.find("# time "), end = text.find('\n', text.find("# process "));
    REQUIRE(end != std::string::npos);
    return text.erase(line, end - line);
  };
  CHECK(without_measures(again.out) == without_measures(first.out));
  CHECK(desk.perikit("run scene.toml --quiet -o a --set integrator.end_time=0.5").status == 0);
  CHECK(desk.perikit("run resolved.toml --quiet -o b").status == 0);
  CHECK_MESSAGE(desk.text("a/history.csv") == desk.text("b/history.csv"), "the resolved scene runs differently");
}

TEST_CASE("cli: --set, --explain, --quiet and --threads") {
  const Desk desk;
  const Result quiet = desk.perikit("run scene.toml --quiet -o quiet");
  CHECK(quiet.status == 0);
  CHECK(quiet.out.empty());
  CHECK(quiet.err.empty());
  CHECK(contains(desk.perikit("run scene.toml -o loud").out, "frames in loud"));
  CHECK(contains(desk.perikit("run scene.toml --explain -o explained").out, "skipped:"));
  CHECK(desk.perikit("run scene.toml --quiet -o set --set 'title=\"other\"' --set integrator.end_time=0.1 --set kinematics.type=conventional").status == 0);
  CHECK(contains(desk.text("set/scene.toml"), "title = \"other\""));
  CHECK(contains(desk.text("set/scene.toml"), "conventional"));
  CHECK(read_frames(desk.path("set")).back().time == 0.1);
  const Result wrong = desk.perikit("run scene.toml --set integrator.end_tiem=0.1");
  CHECK(wrong.status == 2);
  CHECK(contains(wrong.err, "did you mean 'end_time'"));
  CHECK(desk.perikit("run scene.toml --quiet --threads 1 -o one").status == 0);
  CHECK(desk.perikit("run scene.toml --quiet --threads 2 -o two").status == 0);
  CHECK(desk.text("one/history.csv") == desk.text("two/history.csv"));
  // All cores, which OpenMP's variable limits, unless the scene says how many, or the command line, which has the last word.
  const auto threads = [&](const std::string& more, const std::string& count) {
    const Result run = desk.perikit("run scene.toml -o threads " + more, "OMP_NUM_THREADS=3");
    CHECK_MESSAGE(contains(run.out, " a point and step, " + count + ")"), more, ": no '", count, "' in\n", run.out);
  };
  threads("", "3 threads");
  threads("--set run.threads=2", "2 threads");
  threads("--threads 1", "1 thread");
  threads("--threads 4 --set run.threads=2", "4 threads");
}

TEST_CASE("cli: the end of a run tells time, speed, memory, energy balance and warnings, here and in run.log") {
  const Desk desk;
  const Result run = desk.perikit("run scene.toml -o out");
  REQUIRE(run.status == 0);
  for (const std::string word : {" s in all: ", "s set-up", "s plan", "s steps", "s output (6 frames, 51 rows of history, 0 checkpoints)", "50 steps of 40 points", "points/s", "MB of arrays", "work put in",
                                 "warnings      none", "6 frames in out"}) {
    CHECK_MESSAGE(contains(run.out, word), "no '", word, "' in\n", run.out);
    CHECK_MESSAGE(contains(desk.text("out/run.log"), word), "no '", word, "' in run.log");
  }
  const std::size_t at = run.out.find("balance off by ");
  REQUIRE(at != std::string::npos);
  CHECK(std::stod(run.out.substr(at + 15)) < 0.01);
  // Neither Poisson's ratio 0.3 nor one stiffness in all directions is what the bonds of this lattice have.
  const Result warned = desk.perikit("run scene.toml -o warned --set 'kinematics={type=\"bond_based\",surface_correction=\"none\"}'");
  CHECK_MESSAGE(contains(warned.out, "warnings      2\n  warning"), warned.out);
}

TEST_CASE("cli: the folder of a run") {
  const Desk desk;
  REQUIRE(desk.perikit("run scene.toml -o out").status == 0);
  std::set<std::string> found, expected{"results.h5", "reference.h5", "results.xdmf", "history.csv", "scene.toml", "run.log", "frames"};
  for (const auto& entry : fs::directory_iterator(desk.path("out"))) found.insert(entry.path().filename());
  CHECK(found == expected);
  const std::vector<std::string> history = lines(desk.text("out/history.csv"));
  REQUIRE(history.size() == 1 + 51);
  CHECK(history[0] == "step,time,time_step,strain_energy,kinetic_energy,external_work,dissipated_energy,iterations,residual,pull");
  for (const std::string& row : history) CHECK(std::count(row.begin(), row.end(), ',') == 9);
  CHECK(contains(desk.text("out/run.log"), "50 steps of 0.02 s"));
  for (int k = 0; k < 6; ++k) {
    const Frame frame = read_frame(desk.path("out/results.h5"), fmt::format("/frames/{:08}", k));
    CHECK_MESSAGE(frame.values == 3 * points, "results.h5 does not show frame ", k);
    CHECK(frame.step == 10 * k);
  }
  CHECK(contains(desk.text("out/results.xdmf"), "00000005"));
  const perikit::LoadedFrame last = perikit::read_last_frame(desk.path("out/results.h5"), points);
  CHECK(last.time == 1.0);
  CHECK(last.step == 50);
  for (const std::string field : {"displacement", "velocity", "strain_energy_density"}) CHECK_MESSAGE(last.fields.contains(field), "no field ", field);
  CHECK(desk.perikit("check out/scene.toml").status == 0);
  // A run starts from the last frame of an earlier one.
  desk.write("next.toml", plate + "\n[initial]\nfrom = \"out/results.h5\"\n");
  const Result next = desk.perikit("run next.toml --quiet -o next");
  CHECK_MESSAGE(next.status == 0, next.err);
}

TEST_CASE("cli: a run says whose results it replaces, and never replaces its own scene") {
  const Desk desk;
  const auto run = [&](const std::string& options) { return desk.perikit("run scene.toml -o out " + options); };
  const std::string said = "replaces the results of an earlier run in out",
                    stopped = "warning: replaces a run in out that was stopped and kept a checkpoint at step ";
  const Result first = run("");
  CHECK(!contains(first.err + desk.text("out/run.log"), "replaces"));
  for (const std::string before : {"of a run that ended", "of a run with checkpoints that ended"}) {
    INFO(before);
    const Result again = run("--set output.checkpoint_every=20");
    CHECK(again.status == 0);
    CHECK(contains(again.err, said));
    CHECK(!contains(again.err, stopped));
    CHECK(contains(desk.text("out/run.log"), said));
  }
  // A run that ends in the middle: the last checkpoint is that of step 40.
  REQUIRE(
      run("--quiet --set output.checkpoint_every=20 --set 'boundary=[{set=\"right\",velocity=[\"-400*(t > 0.85)\",\"free\"]}]'")
          .status == 1);
  const Result after = run("");
  CHECK(after.status == 0);
  CHECK(contains(after.err, stopped + "40, time 0.8 s: --resume would have gone on with it"));
  CHECK(contains(desk.text("out/run.log"), stopped));
  CHECK(!contains(run("--quiet").err, "replaces"));

  const std::string own = desk.text("scene.toml");
  const Result refused = desk.perikit("run scene.toml -o .");
  CHECK(refused.status == 2);
  CHECK_MESSAGE(contains(refused.err,
                         "output: found scene.toml, which is read, where ./scene.toml would be written or removed; allowed: "
                         "another folder (-o)"),
                refused.err);
  CHECK(desk.text("scene.toml") == own);
  CHECK(desk.perikit("run out/scene.toml -o out").status == 0);  // this is what it would write
}

TEST_CASE("cli: frames, every and times give the frames that they promise") {
  const auto frames_of = [](const std::string& output) {
    const Desk desk(replaced(plate, "frames = 5", output));
    const Result result = desk.perikit("run scene.toml --quiet -o out");
    REQUIRE_MESSAGE(result.status == 0, result.err);
    return read_frames(desk.path("out"));
  };
  const auto steps_of = [&](const std::string& output) {
    std::vector<std::int64_t> steps;
    for (const Frame& frame : frames_of(output)) {
      steps.push_back(frame.step);
      CHECK(std::abs(frame.time - 0.02 * static_cast<double>(frame.step)) <= 1e-14);
      CHECK(frame.values == 3 * points);
    }
    return steps;
  };
  using Steps = std::vector<std::int64_t>;
  CHECK(steps_of("frames = 5") == Steps{0, 10, 20, 30, 40, 50});
  CHECK(steps_of("frames = 3") == Steps{0, 17, 34, 50});      // the first step at or after k/3
  CHECK(steps_of("frames = 1") == Steps{0, 50});
  CHECK(steps_of("frames = 500").size() == 51);               // every step once
  CHECK(steps_of("every = 20") == Steps{0, 20, 40, 50});      // and the end
  CHECK(steps_of("every = 25") == Steps{0, 25, 50});
  CHECK(steps_of("times = [0.0, 0.31, 0.4, 1.0]") == Steps{0, 16, 20, 50});
}

TEST_CASE("cli: kill -9 leaves every finished frame readable") {
  const Desk desk(replaced(replaced(plate, "frames = 5", "every = 1"), "end_time = 1.0", "end_time = 4000.0"));
  const pid_t child = desk.start({"run", "scene.toml", "-o", "out"});
  REQUIRE(child > 0);
  const auto start = std::chrono::steady_clock::now();
  while (!fs::exists(desk.path("out/frames/00000011.h5")) && std::chrono::steady_clock::now() - start < std::chrono::seconds(60)) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  kill(child, SIGKILL);
  int status = 0;
  waitpid(child, &status, 0);
  REQUIRE_MESSAGE(WIFSIGNALED(status), "the run had ended before it was killed");
  const std::vector<Frame> frames = read_frames(desk.path("out"));
  REQUIRE(frames.size() > 11);
  for (std::size_t k = 0; k < frames.size(); ++k) {
    CHECK_MESSAGE(frames[k].values == 3 * points, "frame ", k, " cannot be read");
    CHECK(frames[k].step == static_cast<std::int64_t>(k));
  }
  // The list may lack the frame that was just finished, no other.
  const std::int64_t listed = perikit::read_last_frame(desk.path("out/results.h5"), points).step;
  CHECK(listed >= frames.back().step - 1);
  const std::string history = desk.text("out/history.csv");
  CHECK(lines(history).size() > 11);
  CHECK_MESSAGE(history.back() == '\n', "history.csv ends within a row");
}

TEST_CASE("cli: a signal ends a run in order") {
  const Desk desk(replaced(plate, "end_time = 1.0", "end_time = 1.0e6"));
  const pid_t child = desk.start({"run", "scene.toml", "-o", "out"});
  REQUIRE(child > 0);
  const auto start = std::chrono::steady_clock::now();
  while (lines(desk.text("out/history.csv")).size() < 10 && std::chrono::steady_clock::now() - start < std::chrono::seconds(60)) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  kill(child, SIGTERM);
  int status = 0;
  waitpid(child, &status, 0);
  REQUIRE(WIFEXITED(status));
  CHECK(WEXITSTATUS(status) == 1);
  const std::vector<Frame> frames = read_frames(desk.path("out"));
  REQUIRE(frames.size() >= 2);
  CHECK(frames.back().values == 3 * points);
  CHECK_MESSAGE(frames.back().step >= 8, "the state at the end is not kept");
}

TEST_CASE("cli: newton refuses a tangent that memory does not hold, with the numbers" * doctest::skip(unlimited_addresses)) {
  const Desk desk(SceneText{.upper = {300, 300}, .sets = "left = \"x < 1\"", .family = "horizon_ratio = 6.015",
                            .further = "[[boundary]]\nset = \"left\"\ndisplacement = [0, 0]\n[[load]]\nset = \"all\"\nforce = [0, 1]",
                            .integrator = "type = \"newton\"\nlinear_solver = \"direct\""});
  for (const std::string command : {"check scene.toml", "run scene.toml -o out --threads 1"}) {
    const Result failed = desk.perikit(command, "ulimit -v 1000000;");
    INFO(failed.err);
    CHECK(failed.status == 1);
    CHECK(contains(failed.err, "newton: matrices, factors and vectors of its solver need about "));
    CHECK(contains(failed.err, "this machine offers 1.02 GB"));
    CHECK_MESSAGE(!fs::exists(desk.path("out")), "a refused run leaves a folder");
  }
}

TEST_CASE("cli: an inadmissible run ends with status 1 and says where, when and what is left") {
  const Desk every(replaced(plate, "frames = 5", "every = 1") + "\n[initial]\nvelocity = [\"-60*(x > 4)\", 0]\n");
  const Result failed = every.perikit("run scene.toml -o out");
  INFO(failed.err);
  CHECK(failed.status == 1);
  for (const std::string word : {"the run failed", "inadmissible", "point ", "(", "step ", "time ", "kinematics baqp", "material neo_hookean", "last good frame: "}) {
    CHECK_MESSAGE(contains(failed.err, word), "no '", word, "'");
  }
  const std::vector<Frame> frames = read_frames(every.path("out"));
  REQUIRE(!frames.empty());
  for (const Frame& frame : frames) CHECK(frame.values == 3 * points);
  CHECK_MESSAGE(contains(failed.err, fmt::format("last good frame: {}", frames.size() - 1)), frames.size(), " frames");
  CHECK(contains(every.text("out/run.log"), fmt::format("last good frame: {}", frames.size() - 1)));
  CHECK(perikit::read_last_frame(every.path("out/results.h5"), points).step == frames.back().step);
}

TEST_CASE("cli: bench gives a table and the same figures for other programs") {
  const Desk desk(plate);
  const std::string counts = "kinematics,material,dimension,body,cells,operations\n";
  desk.write("counts.csv", counts + "sub_horizon,hencky,2,lattice,5,1234.5\nsub_horizon,hencky,2,cloud,5,2345.5\n"
             "sub_horizon,hencky,2 stress,lattice,5,3456.5\nsub_horizon,hencky,2 stress,cloud,5,4567.5\n");
  const std::string command = "bench --cells 5 --kinematics sub_horizon --material hencky --dimension 2 --plane strain stress";
  const Result result = desk.perikit(command + " --operations counts.csv --assembly --json figures.json");
  INFO(result.err);
  REQUIRE(result.status == 0);
  CHECK(contains(result.out, "| sub_horizon | hencky | 2 | lattice |"));
  CHECK(contains(result.out, "| sub_horizon | hencky | 2 | cloud |"));
  CHECK(contains(result.out, "| sub_horizon | hencky | 2 stress | cloud |"));
  const std::string figures = desk.text("figures.json");
  for (const std::string word : {"\"triad_GB_per_s\": ", "\"kinematics\": \"sub_horizon\", \"material\": \"hencky\", \"dimension\": 2, \"body\": \"cloud\", \"points\": 25, \"lateral\": \"strain\"", "\"points\": 25, \"lateral\": \"stress\""})
    CHECK_MESSAGE(contains(figures, word), word, " is missing in ", figures);
  CHECK_MESSAGE(!contains(figures, "null"), figures);
  CHECK(contains(figures, "\"operations\": 2345.5, \"of_triad\": "));
  const Result uncounted = desk.perikit(command);   // not at this size
  CHECK(uncounted.status == 0);
  CHECK(contains(uncounted.out, "%) | - | - |"));
  desk.write("counts.csv", counts + "sub_horizon,hencky,2,cloud,5,many\n");
  const Result refused = desk.perikit(command + " --operations counts.csv");
  CHECK(refused.status == 2);
  CHECK(contains(refused.err, "counts.csv:2:1: found 'sub_horizon,hencky,2,cloud,5,many'"));
  const Result full = desk.perikit("bench --cells 5 --kinematics conventional --json no/such/folder.json");
  CHECK(full.status == 1);
  CHECK(contains(full.err, "no/such/folder.json: cannot be written"));
}

TEST_CASE("cli: check says what solvers of load steps take, within half of what the run then takes") {
  const auto scene = [](const std::string& body, const std::string& kinematics, const std::string& integrator) {
    return fmt::format("format = 1\n[body]\n{}\n[sets]\nlow = \"x < 0.1\"\nhigh = \"x > 1.3\"\n[family]\nhorizon_ratio = 2.015\n[kinematics]\ntype = \"{}\"\n[material]\ntype = \"neo_hookean\"\n"
                       "youngs_modulus = 1e6\npoisson_ratio = 0.3\n[[boundary]]\nset = \"low\"\ndisplacement = VECTOR\n[[boundary]]\nset = \"high\"\nvelocity = VECTOR\n[integrator]\n{}\nsteps = 1\n",
                       body, kinematics, integrator);
  };
  const std::string solid = "dimension = 3\nlattice = { spacing = 0.1, lower = [0, 0, 0], upper = [1.4, 0.8, 0.8] }",
                    plane = "dimension = 2\nplane = \"strain\"\nlattice = { spacing = 0.025, lower = [0, 0], upper = [1.4, 1] }";
  for (const std::string& body : {solid, plane})
    for (const std::string integrator : {"type = \"newton\"\nlinear_solver = \"direct\"", "type = \"newton\"", "type = \"jfnk\"\npreconditioner = \"companion\""}) {
      INFO(body, " ", integrator);
      std::string text = replaced(scene(body, "baqp", integrator), "VECTOR", body == solid ? "[0, 0, 0]" : "[0, 0]");
      text = replaced(text, "velocity = VECTOR", body == solid ? "displacement = [0.02, 0, 0]" : "displacement = [0.02, 0]");
      const Desk desk(text);
      const Result check = desk.perikit("check scene.toml --threads 1"), run = desk.perikit("run scene.toml -o out --threads 1");
      REQUIRE_MESSAGE(check.status == 0, check.err);
      REQUIRE_MESSAGE(run.status == 0, run.err);
      const std::string before = "process       about ", taken = " MB of arrays, ";
      REQUIRE(contains(check.out, before));
      REQUIRE(contains(run.out, taken));
      const double predicted = std::stod(check.out.substr(check.out.find(before) + before.size())), measured = std::stod(run.out.substr(run.out.find(taken) + taken.size()));
      CHECK_MESSAGE(predicted <= 1.5 * measured, predicted, " MB, and ", measured);
      CHECK_MESSAGE(measured <= 1.5 * predicted, predicted, " MB, and ", measured);
    }
}

TEST_CASE("cli: check draws the body of a scene, and shows what it holds") {
  const Desk desk(replaced(plate, "[integrator]", "[[load]]\nset = \"right\"\nforce = [0, 3]\n\n[integrator]"));
  const Result checked = desk.perikit("check scene.toml -o body.svg");
  CHECK_MESSAGE(checked.status == 0, checked.err);
  const std::string picture = desk.text("body.svg");
  for (const char* word : {"held", "loaded", "in a set"}) CHECK_MESSAGE(contains(picture, word), word);
  for (const char* line : {"# box           points at x 0.5 to 7.5, y 0.5 to 4.5 m; 40 m^3", "# set           left: 10 points, 10 m^3, at x 0.5 to 1.5, y 0.5 to 4.5",
                           "# material      neo_hookean: 40 points, 40 kg", "# held          xy of set left, 10 points by boundary.0 (displacement)",
                           "# held          x of set right, 10 points by boundary.1 (velocity)", "# loads         together (0, 3) N at the end, moment 21 N m about the origin"})
    CHECK_MESSAGE(contains(checked.out, line), line, "\n", checked.out);
  CHECK(desk.perikit("check scene.toml -o body.txt").status == 2);
}
