/// What a run does to the folder that it writes into: nothing that perikit did not write is replaced or removed, and no two runs
/// share one.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <chrono>
#include <csignal>
#include <thread>

#include "robustness/desk.hpp"

using namespace perikit::test;

namespace {

void refused(const Result& result, const std::string& word) {
  CHECK(result.status == 2);
  CHECK_MESSAGE(contains(result.err, word), "no '", word, "' in\n", result.err);
}

/// The points of the plate as a file.
std::string cloud() {
  std::string text = "x,y,volume\n";
  for (int j = 0; j < 5; ++j)
    for (int i = 0; i < 8; ++i) text += fmt::format("{},{},1\n", i + 0.5, j + 0.5);
  return text;
}

std::string cloud_scene(const std::string& file) {
  return replaced(plate, "[body.lattice]\nspacing = 1.0\nlower = [0, 0]\nupper = [8, 5]\n",
                  "[body.points]\nfile = \"" + file + "\"\n");
}

}  // namespace

TEST_CASE("folders: foreign files are kept, unless --force replaces them") {
  const Desk desk;
  for (const std::string name :
       {"history.csv", "results.h5", "run.log", "scene.toml", "frames/00000003.h5", "frames/notes.txt"}) {
    INFO(name);
    fs::remove_all(desk.path("out"));
    fs::create_directories(desk.path("out/frames"));
    desk.write("out/" + name, "mine");
    refused(desk.perikit("run scene.toml --quiet -o out"), "--force");
    CHECK(desk.text("out/" + name) == "mine");
    const Result forced = desk.perikit("run scene.toml --quiet -o out --force");
    CHECK_MESSAGE(forced.status == 0, forced.err);
    CHECK(desk.text("out/" + name) != (name == "frames/notes.txt" ? "" : "mine"));
    // Now it is perikit's own.
    CHECK(desk.perikit("run scene.toml --quiet -o out").status == 0);
  }
  // Files that no run writes are left alone, and in nobody's way.
  desk.write("out/notes.txt", "mine");
  CHECK(desk.perikit("run scene.toml --quiet -o out").status == 0);
  CHECK(desk.text("out/notes.txt") == "mine");
}

TEST_CASE("folders: a scene.toml that was changed since is nobody's to replace") {
  const Desk desk;
  REQUIRE(desk.perikit("run scene.toml --quiet -o out").status == 0);
  const std::string changed = desk.text("out/scene.toml") + "# a note of mine\n";
  desk.write("out/scene.toml", changed);
  refused(desk.perikit("run scene.toml --quiet -o out"),
          "out/scene.toml: output: found a file that perikit did not write, or that was changed since");
  refused(desk.perikit("run out/scene.toml --quiet -o out"), "out/scene.toml, which is read, where ");
  CHECK(desk.text("out/scene.toml") == changed);
}

TEST_CASE("folders: what a run reads is not where it writes") {
  const Desk desk(cloud_scene("out/history.csv"));
  fs::create_directories(desk.path("out"));
  desk.write("out/history.csv", cloud());
  for (const std::string force : {"", " --force"}) {
    refused(desk.perikit("run scene.toml --quiet -o out" + force), "history.csv, which is read, where ");
    CHECK(desk.text("out/history.csv") == cloud());
  }
  const Desk other;
  REQUIRE(other.perikit("run scene.toml --quiet -o out").status == 0);
  const std::string results = other.text("out/results.h5"), frame = other.text("out/frames/00000005.h5");
  for (const std::string from : {"out/results.h5", "./out/../out/results.h5"}) {
    other.write("next.toml", plate + fmt::format("\n[initial]\nfrom = \"{}\"\n", from));
    refused(other.perikit("run next.toml --quiet -o out --force"), "results.h5, which is read, where ");
    CHECK(other.text("out/results.h5") == results);
    CHECK(other.text("out/frames/00000005.h5") == frame);
  }
  fs::create_directory_symlink(other.path("out"), other.path("link"));
  refused(other.perikit("run next.toml --quiet -o link"), "results.h5, which is read, where ");
}

TEST_CASE("folders: links are not followed") {
  const Desk desk;
  for (const std::string name : {"frames", "history.csv"}) {
    INFO(name);
    fs::remove_all(desk.path("out"));
    REQUIRE(desk.perikit("run scene.toml --quiet -o out").status == 0);
    fs::remove_all(desk.path("out/" + name));
    fs::create_directories(desk.path("elsewhere"));
    desk.write("elsewhere/00000001.h5", "mine");
    fs::create_symlink(name == "frames" ? desk.path("elsewhere") : desk.path("elsewhere/00000001.h5"), desk.path("out/" + name));
    refused(desk.perikit("run scene.toml --quiet -o out"), "a symbolic link");
    CHECK(desk.text("elsewhere/00000001.h5") == "mine");
    const Result forced = desk.perikit("run scene.toml --quiet -o out --force");
    CHECK_MESSAGE(forced.status == 0, forced.err);
    CHECK(desk.text("elsewhere/00000001.h5") == "mine");
    CHECK(!fs::is_symlink(desk.path("out/" + name)));
  }
}

TEST_CASE("folders: two runs do not share one") {
  const Desk desk(replaced(plate, "end_time = 1.0", "end_time = 1.0e6"));
  const pid_t child = desk.start({"run", "scene.toml", "-o", "out"});
  REQUIRE(child > 0);
  const auto start = std::chrono::steady_clock::now();
  while (lines(desk.text("out/history.csv")).size() < 10 && std::chrono::steady_clock::now() - start < std::chrono::seconds(60)) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  const std::string log = desk.text("out/run.log");
  for (const std::string options : {"", " --force", " --resume"})
    refused(desk.perikit("run scene.toml --quiet -o out" + options),
            "out: output: found the folder of another run or study that is writing into it");
  CHECK(desk.text("out/run.log") == log);
  kill(child, SIGKILL);
  int status = 0;
  waitpid(child, &status, 0);
  REQUIRE_MESSAGE(WIFSIGNALED(status), "the run had ended before it was killed");
  // The lock goes with the process, and so does what it left half written.
  desk.write("out/.history.csv.4711.part", "torn");
  desk.write("out/.mine.part", "mine");
  CHECK(desk.perikit("run scene.toml --quiet -o out --set integrator.end_time=1.0").status == 0);
  CHECK(!fs::exists(desk.path("out/.history.csv.4711.part")));
  CHECK(fs::exists(desk.path("out/.mine.part")));
}

TEST_CASE("folders: studies keep foreign files, too, and a missing scene.toml is written again by --resume") {
  const Desk desk(replaced(plate, "frames = 5", "frames = 5\ncheckpoint_every = 50"));
  desk.write("study.toml",
             "format = 1\nscene = \"scene.toml\"\n[values]\nmaterial.density = [1.0, 2.0]\n[[quantity]]\nname = \"energy\"\nfrom "
             "= \"strain_energy\"\n");
  fs::create_directories(desk.path("out"));
  desk.write("out/table.csv", "mine");
  refused(desk.perikit("study study.toml --quiet -o out"), "out/table.csv: output: found it beside no study.toml that perikit wrote");
  CHECK(desk.text("out/table.csv") == "mine");
  refused(desk.perikit("study study.toml --quiet -o ."), "study.toml, which is read, where ");
  CHECK(desk.perikit("study study.toml --quiet -o out --force").status == 0);
  CHECK(desk.perikit("study study.toml --quiet -o out --resume").status == 0);

  REQUIRE(desk.perikit("run scene.toml --quiet -o run").status == 0);
  const std::string scene = desk.text("run/scene.toml");
  fs::remove(desk.path("run/scene.toml"));
  const Result resumed = desk.perikit("run scene.toml --quiet -o run --resume");
  CHECK_MESSAGE(resumed.status == 0, resumed.err);
  CHECK(desk.text("run/scene.toml") == scene);
}
