/// Interruptions beside those of resume.cpp: runs with failing bonds and load steps that are killed, files that were cut or
/// changed in between, libraries that were replaced, disks that are full and folders that are closed.

#include <doctest/doctest.h>

#include "robustness/same_results.hpp"

using namespace perikit::test;

namespace {

/// The plate torn apart: bonds fail from the first third of the run on.
std::string torn_plate(const std::string& kinematics, const std::string& damage) {
  return replaced(replaced(long_plate(), "type = \"baqp\"", "type = \"" + kinematics + "\""), "[output]",
                  "[damage]\n" + damage + "\n[output]\nfields = [\"displacement\", \"velocity\", \"damage\"]");
}

/// The plate pulled in load steps.
std::string load_steps(const std::string& integrator, int steps, const std::string& more = {}) {
  std::string scene = replaced(plate, "velocity = [0.1, \"free\"]", "displacement = [0.6, \"free\"]");
  scene = replaced(scene, "type = \"verlet\"\ntime_step = 0.02\nend_time = 1.0",
                   fmt::format("type = \"{}\"\nsteps = {}\n{}", integrator, steps, more));
  return replaced(scene, "frames = 5", "every = 7\ncheckpoint_every = 1");
}

double last_number(const std::string& history, int column) {
  std::istringstream row(lines(history).back());
  std::string cell;
  for (int k = 0; k <= column; ++k) std::getline(row, cell, ',');
  return std::stod(cell);
}

struct Torn {
  std::string name, scene;
};

/// Small bodies whose bonds fail, in every integrator that has steps.
std::vector<Torn> torn_bodies() {
  const std::string stretch = "type = \"critical_stretch\"\nstretch = 0.05", smooth = "type = \"smooth_degradation\"\nstretch_min = 0.02\nstretch = 0.08";
  std::vector<Torn> all{{"verlet, bond_based", torn_plate("bond_based", stretch)},
                        {"verlet, ordinary, smooth", torn_plate("ordinary", smooth)},
                        {"verlet, baqp", torn_plate("baqp", stretch)}};
  for (const std::string integrator : {"newton", "jfnk", "kinsol", "dynamic_relaxation"}) {
    std::string scene = replaced(load_steps(integrator, 20, "tolerance = 1e-6"), "displacement = [0.6, \"free\"]", "displacement = [1.2, \"free\"]");
    scene = replaced(scene, "type = \"baqp\"", "type = \"bond_based\"");
    // Free ends would be loose pieces once the plate is in two; the grips are whole.
    all.push_back({integrator, replaced(scene, "[output]", "[damage]\n" + smooth + "\nno_fail = [\"left\", \"right\"]\n[output]\nfields = [\"displacement\", \"damage\"]")});
  }
  return all;
}

/// Kills runs of every torn body in turn until there were `least` kills of each, and compares every end with that of a run without a stop.
/// first: the longest time to the first kill [ms]. Returns the kills.
int kill_each(int least, int first) {
  const auto seed = std::random_device{}();
  INFO("seed ", seed);
  std::mt19937 random(seed);
  int all = 0;
  for (const Torn& torn : torn_bodies()) {
    INFO(torn.name);
    const Desk desk(torn.scene);
    const auto whole = desk.perikit("run scene.toml --quiet -o whole");
    REQUIRE_MESSAGE(whole.status == 0, whole.err);
    REQUIRE_MESSAGE(last_number(desk.text("whole/history.csv"), 6) > 0, "no bond has failed");  // dissipated_energy
    int kills = 0, runs = 0;
    do {
      fs::remove_all(desk.path("out"));
      kills += run_with_kills(desk, "out", random, first);
      ++runs;
      check_same_results(desk, "out", "whole");
    } while (kills < least);
    MESSAGE(torn.name, ": ", kills, " kills, ", runs, " runs come to their end");
    all += kills;
  }
  return all;
}

}  // namespace

TEST_CASE("interruptions: in every integrator, a run whose bonds fail, killed, ends as without a stop") { kill_each(1, 400); }

// ninja many_kills: an hour.
TEST_CASE("interruptions: many kills of every integrator" * doctest::skip()) {
  const char* asked = std::getenv("PERIKIT_KILLS");
  const int wanted = asked ? std::atoi(asked) : 1000, bodies = static_cast<int>(torn_bodies().size());
  REQUIRE(wanted > 0);
  const int kills = kill_each((wanted + bodies - 1) / bodies, 80);
  MESSAGE(kills, " kills");
  CHECK(kills >= wanted);
}

TEST_CASE("interruptions: load steps that are killed again and again end as without a stop") {
  const auto seed = std::random_device{}();
  INFO("seed ", seed);
  std::mt19937 random(seed);
  const Desk desk(load_steps("newton", 150));
  const auto whole = desk.perikit("run scene.toml --quiet -o whole");
  REQUIRE_MESSAGE(whole.status == 0, whole.err);
  MESSAGE(run_with_kills(desk, "out", random), " kills");
  check_same_results(desk, "out", "whole");
}

TEST_CASE("interruptions: every quasi-static integrator ends its step at a signal, keeps it, and goes on from it") {
  for (const std::string integrator : {"newton", "jfnk", "kinsol", "dynamic_relaxation"}) {
    INFO(integrator);
    const Desk desk(load_steps(integrator, 40));
    const auto whole = desk.perikit("run scene.toml --quiet -o whole");
    REQUIRE_MESSAGE(whole.status == 0, whole.err);
    for (const int signal : {SIGINT, SIGTERM}) {
      const int status = stop_after(desk, "out", 5, signal);
      if (status == 0) continue;  // the end came first
      CHECK(status == 1);
      CHECK(contains(desk.text("out/run.log"), "stopped by a signal after step"));
      CHECK(contains(desk.text("out/run.log"), "go on with --resume -o out"));
    }
    const Result last = desk.perikit("run scene.toml --resume -o out");
    CHECK_MESSAGE(last.status == 0, last.err);
    check_same_results(desk, "out", "whole");
  }
}

TEST_CASE("interruptions: after any file was cut, a resumed run ends as without it or names the file") {
  const Desk desk(replaced(long_plate(), "end_time = 6.0", "end_time = 2.0"));
  REQUIRE(desk.perikit("run scene.toml --quiet -o whole").status == 0);
  // Stopped in the middle: frames and rows on either side of the checkpoint.
  int refused = 0;
  for (const std::string file : {"results.h5", "reference.h5", "results.xdmf", "history.csv", "checkpoint.h5", "run.log",
                                 "scene.toml", "frames/00000001.h5", "frames/00000004.h5"}) {
    for (const double share : {0.0, 0.97}) {
      INFO(file, " cut to ", share);
      fs::remove_all(desk.path("out"));
      fs::copy(desk.path("whole"), desk.path("out"), fs::copy_options::recursive);
      const auto size = fs::file_size(desk.path("out/" + file));
      fs::resize_file(desk.path("out/" + file), static_cast<std::uintmax_t>(share * static_cast<double>(size)));
      const Result resumed = desk.perikit("run scene.toml --resume -o out");
      if (resumed.status == 0) {
        check_same_results(desk, "out", "whole");
      } else {
        ++refused;
        CHECK(resumed.status == 2);
        CHECK_MESSAGE(contains(resumed.err, "out/" + file + ":"), resumed.err);
        CHECK(lines(resumed.err).size() == 1);
      }
      // A fresh start needs nothing of it.
      if (share == 0.0) CHECK(desk.perikit("run scene.toml --quiet -o out").status == 0);
    }
  }
  CHECK(refused > 5);
}

TEST_CASE("interruptions: a checkpoint with one other byte is refused") {
  const Desk desk(replaced(long_plate(), "end_time = 6.0", "end_time = 0.5"));
  REQUIRE(desk.perikit("run scene.toml --quiet -o out").status == 0);
  std::string bytes = desk.text("out/checkpoint.h5");
  // Values of the state, which HDF5 itself does not guard: a displacement of the last frame stands there as it is.
  const double value = read_frames(desk.path("out")).back().displacement[3 * (points - 1)];
  REQUIRE(value != 0);
  const std::size_t at = bytes.find(std::string(reinterpret_cast<const char*>(&value), sizeof value));
  REQUIRE(at != std::string::npos);
  bytes[at] = static_cast<char>(bytes[at] ^ 1);
  std::ofstream(desk.path("out/checkpoint.h5"), std::ios::binary) << bytes;
  const Result resumed = desk.perikit("run scene.toml --resume -o out");
  CHECK(resumed.status == 2);
  CHECK_MESSAGE(contains(resumed.err, "out/checkpoint.h5: found other bytes than were written"), resumed.err);
}

TEST_CASE("interruptions: a library that was replaced between run and resume is refused by name") {
  const std::string library = "company.so";
  const Desk desk(replaced(replaced(long_plate(), "horizon_ratio = 2.015", "horizon_ratio = 2.015\ninfluence = \"company\""),
                           "end_time = 6.0", "end_time = 1.0"));
  fs::create_directory(desk.path("parts"));
  fs::copy(fs::path(PERIKIT_LIES) / library, desk.path("parts/" + library));
  REQUIRE(desk.perikit("run scene.toml --quiet --plugin-path parts -o out").status == 0);
  const Result same = desk.perikit("run scene.toml --resume --plugin-path parts -o out");
  CHECK_MESSAGE(same.status == 0, same.err);
  // The same parts in another file: one byte more.
  std::ofstream(desk.path("parts/" + library), std::ios::binary | std::ios::app) << ' ';
  const Result other = desk.perikit("run scene.toml --resume --plugin-path parts -o out");
  CHECK(other.status == 2);
  CHECK_MESSAGE(contains(other.err, "found libraries that are not those that the run began with: company.so; allowed: "),
                other.err);
  // Replaced by what is no library at all.
  desk.write("parts/" + library, "words");
  const Result broken = desk.perikit("run scene.toml --resume --plugin-path parts -o out");
  CHECK(broken.status == 2);
  CHECK_MESSAGE(contains(broken.err, "company.so (not a shared library (ELF magic missing))"), broken.err);
}

TEST_CASE("disk: a file system that is full is one clear error, and the run goes on when there is room") {
  // A file system of its own; where user namespaces are not allowed, the limit of resume.cpp must do.
  if (std::system("unshare -rm true 2> /dev/null") != 0) {
    MESSAGE("skipped: no namespaces here");
    return;
  }
  const Desk desk(replaced(replaced(long_plate(), "end_time = 6.0", "end_time = 1.4"), "every = 23", "every = 1"));
  REQUIRE(desk.perikit("run scene.toml --quiet -o whole").status == 0);
  fs::create_directory(desk.path("small"));
  const std::string command = fmt::format(
      "cd '{}' && unshare -rm sh -c \"mount -t tmpfs -o size=160k none small && '{}' run scene.toml --quiet -o small 2> "
      "stderr.txt; echo \\$? > status.txt; cp -r small out\"",
      desk.path("").string(), PERIKIT_PROGRAM);
  REQUIRE(std::system(command.c_str()) == 0);
  const std::string message = desk.text("stderr.txt");
  INFO(message);
  CHECK(desk.text("status.txt") == "1\n");
  CHECK(contains(message, "No space left on device; last good frame: "));
  CHECK(lines(message).size() == 1);
  const std::vector<Frame> frames = read_frames(desk.path("out"));
  CHECK(frames.size() > 1);
  for (const Frame& frame : frames) CHECK(frame.values == 3 * points);
  const Result resumed = desk.perikit("run scene.toml --resume -o out");
  CHECK_MESSAGE(resumed.status == 0, resumed.err);
  check_same_results(desk, "out", "whole");
}

TEST_CASE("disk: a folder that may not be written is one clear error") {
  const Desk desk;
  fs::create_directory(desk.path("closed"));
  fs::permissions(desk.path(""), fs::perms::all);
  fs::permissions(desk.path("closed"), fs::perms::owner_read | fs::perms::owner_exec | fs::perms::group_read |
                                           fs::perms::group_exec | fs::perms::others_read | fs::perms::others_exec);
  std::string as_other;
  if (geteuid() == 0) {  // whom no permission stops
    as_other = "setpriv --reuid=65534 --clear-groups";
    if (std::system(fmt::format("{} '{}' --version > /dev/null 2>&1", as_other, PERIKIT_PROGRAM).c_str()) != 0) {
      MESSAGE("skipped: root cannot become another user here");
      return;
    }
  }
  for (const std::string folder : {"closed", "closed/out"}) {
    const Result result = desk.perikit("run scene.toml --quiet -o " + folder, as_other);
    CHECK(result.status == 1);
    CHECK_MESSAGE(contains(result.err, "Permission denied"), result.err);
    CHECK_MESSAGE(contains(result.err, folder), result.err);
    CHECK(lines(result.err).size() == 1);
  }
}

TEST_CASE("interruptions: a signal within a load step is heeded at once, and the run goes on to the same end") {
  std::string scene = load_steps("dynamic_relaxation", 2, "tolerance = 1e-9\nmax_iterations = 1000000");
  scene = replaced(scene, "spacing = 1.0", "spacing = 0.0625");  // half a second and more for a step
  const Desk desk(replaced(scene, "horizon_ratio = 2.015", "horizon_ratio = 3.015"));
  const pid_t child = desk.start({"run", "scene.toml", "--resume", "-o", "out"});
  const auto running = [&] { return fs::exists(desk.path("out/history.csv")) && lines(desk.text("out/history.csv")).size() > 1; };
  while (!running()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  kill(child, SIGTERM);
  const auto asked = std::chrono::steady_clock::now();
  const int status = wait_for(child);
  CHECK(std::chrono::steady_clock::now() - asked < std::chrono::seconds(5));
  REQUIRE(WIFEXITED(status));
  CHECK(WEXITSTATUS(status) == 1);
  // In either step: the first is over in 0.2 s on a fast machine.
  const std::string log = desk.text("out/run.log");
  const bool within = contains(log, "stopped within step 1, which was given up") || contains(log, "stopped within step 2, which was given up");
  CHECK_MESSAGE(within, log);
  const Result last = desk.perikit("run scene.toml --resume -o out");
  REQUIRE_MESSAGE(last.status == 0, last.err);
  REQUIRE(desk.perikit("run scene.toml --quiet -o whole").status == 0);
  CHECK(desk.text("out/history.csv") == desk.text("whole/history.csv"));
}
