/// Runs that are stopped, killed or out of disk, and go on: what they leave is what a run without a stop leaves.

#include <doctest/doctest.h>

#include "robustness/same_results.hpp"
#include "tests/kit/scene_text.hpp"

using namespace perikit::test;

namespace {

/// A run that is stopped after this many rows of history and goes on has the last frame and the history of one without a stop.
void goes_on_alike(const std::string& scene, std::size_t rows) {
  const Desk desk(scene);
  REQUIRE(desk.perikit("run scene.toml --quiet -o whole").status == 0);
  CHECK(stop_after(desk, "out", rows, SIGTERM) == 1);
  const Result last = desk.perikit("run scene.toml --resume -o out");
  CHECK_MESSAGE(last.status == 0, last.err);
  CHECK(contains(last.out, "resumed after step"));
  for (const std::string file : {"/frames/00000003.h5", "/history.csv"}) {
    const bool same = desk.text("out" + file) == desk.text("whole" + file);
    CHECK_MESSAGE(same, file, " differs");
  }
}

}  // namespace

TEST_CASE("resume: killed at any moment, again and again, a run ends as without a stop") {
  const Desk desk(long_plate());
  REQUIRE(desk.perikit("run scene.toml --quiet -o whole").status == 0);
  const auto seed = std::random_device{}();
  INFO("seed ", seed);
  std::mt19937 random(seed);
  const int kills = run_with_kills(desk, "out", random);
  MESSAGE(kills, " kills");
  check_same_results(desk, "out", "whole");
  // A run that has come to its end stays as it is.
  const Result again = desk.perikit("run scene.toml --resume -o out");
  CHECK_MESSAGE(again.status == 0, again.err);
  CHECK(contains(again.out, "resumed after step 300"));
  check_same_results(desk, "out", "whole");
}

TEST_CASE("resume: a signal keeps the state, and the run goes on from it") {
  const std::string scene = replaced(replaced(long_plate(), "checkpoint_every = 7\n", ""), "every = 23", "frames = 17");
  const Desk desk(scene);
  REQUIRE(desk.perikit("run scene.toml --quiet -o whole").status == 0);
  std::size_t frames = 0;
  for (const int signal : {SIGINT, SIGTERM}) {
    CHECK(stop_after(desk, "out", 30, signal) == 1);
    CHECK(contains(desk.text("out/run.log"), "stopped by a signal after step"));
    CHECK(fs::exists(desk.path("out/checkpoint.h5")));
    // The state of the stop is the last row and the last frame, energies and velocities included.
    const std::vector<Frame> kept = read_frames(desk.path("out"));
    CHECK(kept.size() > frames);
    frames = kept.size();
    CHECK(lines(desk.text("out/history.csv")).back().starts_with(fmt::format("{},", kept.back().step)));
  }
  const Result last = desk.perikit("run scene.toml --resume -o out --threads 1");
  CHECK_MESSAGE(last.status == 0, last.err);
  CHECK(contains(last.out, "resumed after step"));
  check_same_results(desk, "out", "whole");
}

TEST_CASE("resume: laws remember what happened at parts of families that are too poor for a gradient, and come back when no other is left") {
  const std::string scene = SceneText{
      .spacing = 0.25, .lower = {0.875, -3.0}, .upper = {2.625, 0.0}, .sets = "low = \"x < 1.125\"\npart = \"x > 1.7825\"", .family = "horizon_ratio = 1.515\ninfluence = \"inverse\"",
      .kinematics = "sub_horizon", .material = "type = \"hypoelastic\"\ndensity = 166.65\nshear_modulus = 11156.7\nbulk_modulus = 107848.2",
      .further = "[initial]\nvelocity = [\"-0.09*sin(-0.498*x + 0.851*y + 3.37)\", \"0.073*sin(-0.151*x + 1.036*y + 4.24)\"]\n"
                 "[[region]]\nset = \"part\"\nmaterial = { type = \"hypoelastic\", density = 333.3, shear_modulus = 2231.3, bulk_modulus = 21569.6 }\n"
                 "[damage]\ntype = \"max_stress\"\nstrength = 47.36\nno_fail = [\"low\"]\ngradual = true\n"
                 "[output]\nframes = 3\nhistory_every = 1\nfields = [\"displacement\", \"velocity\", \"damage\", \"state:unrotated_stress\"]",
      .integrator = "type = \"verlet\"\nend_time = 1.2\nestimate = \"bond_based\""};
  goes_on_alike(scene, 60);
}

TEST_CASE("resume: points whose bonds have all failed keep what their laws remember") {
  const std::string scene = SceneText{
      .space = "stress", .spacing = 0.25, .lower = {-3.0, 0.0}, .upper = {-1.0, 2.0}, .kinematics = "type = \"conventional\"\nstabilization = \"silling\"",
      .material = "type = \"hypoelastic\"\ndensity = 127.877\nyoungs_modulus = 2335.36\npoisson_ratio = 0.3",
      .further = "[initial]\nvelocity = [\"1.8*sin(-1.0849*x - 1.4273*y + 2.63)\", \"1.6*sin(1.3494*x - 1.3491*y + 3.42)\"]\n[damage]\ntype = \"critical_stretch\"\nstretch = 0.06\n"
                 "[output]\nframes = 3\nhistory_every = 1\nfields = [\"displacement\", \"damage\", \"deformation_gradient\", \"first_piola\", \"state:stretch\"]",
      .integrator = "type = \"verlet\"\nend_time = 0.8\nsafety = 0.5"};
  for (const std::string jitter : {"0.0", "0.2"}) {
    CAPTURE(jitter);
    goes_on_alike(replaced(scene, "spacing = 0.25", "spacing = 0.25\njitter = " + jitter), 20);
  }
}

TEST_CASE("resume: plastic strains go on as they were, in explicit runs and in statics") {
  const std::string scene = SceneText{
      .space = "stress", .spacing = 0.25, .lower = {-3.0, 0.0}, .upper = {-1.0, 2.0}, .sets = "low = \"x < -2.7\"\nhigh = \"x > -1.3\"",
      .material = "type = \"j2\"\ndensity = 127.877\nyoungs_modulus = 2335.36\npoisson_ratio = 0.3\nyield_stress = 20\nhardening = 50",
      .further = "[[boundary]]\nset = \"low\"\ndisplacement = [0, 0]\n[[boundary]]\nset = \"high\"\ndisplacement = [\"0.1*t^2\", \"0.05*t^2\"]\n"
                 "[output]\nframes = 3\nhistory_every = 1\nfields = [\"displacement\", \"state:plastic_strain\", \"state:equivalent_plastic_strain\"]\n"
                 "history = [ { name = \"most\", quantity = \"state:equivalent_plastic_strain\", reduce = \"max\" } ]",
      .integrator = "type = \"verlet\"\nend_time = 1.0\ntime_step = 2.5e-4"};
  goes_on_alike(scene, 60);
  goes_on_alike(replaced(scene, "type = \"verlet\"\nend_time = 1.0\ntime_step = 2.5e-4", "type = \"newton\"\nsteps = 300"), 20);
}

TEST_CASE("resume: a pressure acts on the surface as it was before bonds failed in the last step") {
  const std::string scene = SceneText{
      .dimension = 3, .spacing = 3, .lower = {-15, 0, 0}, .upper = {-3, 15, 12}, .sets = "low = \"z < 3.003\"\nhigh = \"z > 8.997\"", .family = "horizon = 6.045",
      .material = "type = \"linear_elastic\"\nyoungs_modulus = 2.07e9\npoisson_ratio = 0.3\ndensity = 9513.0",
      .further = "[damage]\ntype = \"max_stress\"\nstrength = 9.5e7\nno_fail = [\"high\"]\n"
                 "[initial]\nvelocity = [\"43*sin(0.064*x - 0.116*y + 0.239*z + 3.32)\", \"23*sin(0.174*x - 0.095*y - 0.181*z + 0.999)\", \"25*sin(-0.033*x + 0.074*y + 0.26*z + 5.19)\"]\n"
                 "[[boundary]]\nset = \"low\"\ndisplacement = [0.0, 0.0, 0.0]\n[[load]]\nset = \"high\"\npressure = -95.0e6\nface = \"+z\"\nfollower = true\n"
                 "[output]\nframes = 3\nhistory_every = 1",
      .integrator = "type = \"verlet\"\nend_time = 0.022\nsafety = 0.1"};
  goes_on_alike(scene, 8);
}

TEST_CASE("resume: another scene is refused with what differs") {
  const Desk desk(replaced(long_plate(), "end_time = 6.0", "end_time = 1.0"));
  REQUIRE(desk.perikit("run scene.toml --quiet -o out").status == 0);
  const std::vector<Frame> before = read_frames(desk.path("out"));
  const auto refuse = [&](const std::string& change, const std::vector<std::string>& words) {
    const Result result = desk.perikit("run scene.toml --resume -o out " + change);
    CHECK(result.status == 2);
    for (const std::string& word : words) CHECK_MESSAGE(contains(result.err, word), "no '", word, "' in: ", result.err);
    CHECK(read_frames(desk.path("out")) == before);
  };
  refuse("--set material.shear_modulus=0.9", {"material.shear_modulus: 0.8, now 0.9"});
  refuse("--set integrator.end_time=2.0 --set output.every=24", {"integrator.end_time: 1.0, now 2.0", "output.every: 23, now 24"});
  // Also where the run has left no checkpoint.
  fs::remove(desk.path("out/checkpoint.h5"));
  refuse("--set material.shear_modulus=0.9", {"material.shear_modulus: 0.8, now 0.9"});
  const Result again = desk.perikit("run scene.toml --resume -o out");
  CHECK_MESSAGE(again.status == 0, again.err);
  CHECK(contains(again.out, "no checkpoint to resume from"));
  CHECK(read_frames(desk.path("out")) == before);
  // A damaged checkpoint is named.
  desk.write("out/checkpoint.h5", "no HDF5");
  refuse("", {"checkpoint.h5", "found other bytes than were written"});
}

TEST_CASE("resume: a body from another file is refused") {
  std::string cloud = "x,y,z,volume\n";
  for (int k = 0; k < 40; ++k) cloud += fmt::format("{},{},0,1\n", k % 8 + 0.5, k / 8 + 0.5);
  const Desk desk(replaced(long_plate(), "[body.lattice]\nspacing = 1.0\nlower = [0, 0]\nupper = [8, 5]\n", "[body.points]\nfile = \"cloud.csv\"\n"));
  desk.write("cloud.csv", cloud);
  const Result first = desk.perikit("run scene.toml --quiet -o out --set integrator.end_time=1.0");
  REQUIRE_MESSAGE(first.status == 0, first.err);
  desk.write("cloud.csv", replaced(cloud, "\n1.5,0.5,0,1\n", "\n1.5,0.5,0,0.9\n"));
  const Result result = desk.perikit("run scene.toml --resume -o out --set integrator.end_time=1.0");
  CHECK(result.status == 2);
  CHECK_MESSAGE(contains(result.err, "another body"), result.err);
}

TEST_CASE("disk: a full disk is one clear error, nothing earlier is lost, and the run goes on when there is room") {
  const Desk desk(replaced(replaced(long_plate(), "end_time = 6.0", "end_time = 1.4"), "every = 23", "every = 2"));
  REQUIRE(desk.perikit("run scene.toml --quiet -o whole").status == 0);
  // Blocks of 512 bytes. The longest file reaches the limit after more than half of the frames.
  const std::string limit = fmt::format("ulimit -f {};", fs::file_size(desk.path("whole/results.xdmf")) * 2 / 3 / 512);
  const Result full = desk.perikit("run scene.toml --quiet -o out", limit);
  INFO(full.err);
  CHECK(full.status == 1);
  CHECK(contains(full.err, "results.xdmf: cannot write: File too large; last good frame: "));
  CHECK_MESSAGE(lines(full.err).size() == 1, "more than one line");
  const std::vector<Frame> frames = read_frames(desk.path("out"));
  CHECK(frames.size() > 1);
  for (const Frame& frame : frames) CHECK(frame.values == 3 * points);
  CHECK(desk.text("out/history.csv").back() == '\n');
  REQUIRE(desk.perikit("run scene.toml --quiet --resume -o out").status == 0);
  check_same_results(desk, "out", "whole");
}

TEST_CASE("disk: a folder that cannot be written is one clear error") {
  const Desk desk;
  const Result result = desk.perikit("run scene.toml -o scene.toml/out");
  CHECK(result.status == 1);
  CHECK_MESSAGE(contains(result.err, "scene.toml/out: cannot create the folder: Not a directory"), result.err);
  CHECK(lines(result.err).size() == 1);
}
