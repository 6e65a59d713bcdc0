/// Runs that start from the results of others, and runs that are lengthened.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>

#include "robustness/same_results.hpp"

using namespace perikit::test;

namespace {

std::string torn(const std::string& output = "frames = 5\ncheckpoint_every = 50") {
  return replaced(replaced(replaced(plate, "type = \"baqp\"", "type = \"bond_based\""), "[output]\nframes = 5",
                           "[damage]\ntype = \"critical_stretch\"\nstretch = 0.05\n[output]\n" + output),
                  "end_time = 1.0", "end_time = 6.0");
}

double column(const std::string& history, std::size_t row, int index) {
  std::istringstream cells(lines(history).at(row));
  std::string cell;
  for (int k = 0; k <= index; ++k) std::getline(cells, cell, ',');
  return std::stod(cell);
}

void refused(const Result& result, const std::string& word) {
  CHECK(result.status == 2);
  CHECK_MESSAGE(contains(result.err, word), "no '", word, "' in\n", result.err);
}

}  // namespace

TEST_CASE("going on: bonds that had failed stay so in a run that starts from the results") {
  const Desk desk(torn());
  REQUIRE(desk.perikit("run scene.toml --quiet -o out").status == 0);
  const std::string before = desk.text("out/history.csv");
  REQUIRE(column(before, lines(before).size() - 1, 6) > 0);  // dissipated
  desk.write("next.toml", torn() + "[initial]\nfrom = \"out/results.h5\"\n");
  const Result next = desk.perikit("run next.toml --quiet -o next");
  CHECK_MESSAGE(next.status == 0, next.err);
  CHECK_MESSAGE(contains(desk.text("next/run.log"), "carried       "), desk.text("next/run.log"));
  // The strain energy at the start is that at the end of the earlier run.
  const double end = column(before, lines(before).size() - 1, 3), start = column(desk.text("next/history.csv"), 1, 3);
  CHECK(start == doctest::Approx(end).epsilon(1e-9));
  // Where they would be lost, or are those of another family, it is refused.
  const std::string whole =
      replaced(torn(), "[damage]\ntype = \"critical_stretch\"\nstretch = 0.05\n", "") + "[initial]\nfrom = \"out/results.h5\"\n";
  desk.write("healed.toml", whole);
  refused(desk.perikit("check healed.toml"), "bonds had failed; allowed: a scene with [damage]");
  refused(desk.perikit("check next.toml --set family.horizon_ratio=3.015"), "family.horizon_ratio: 2.015, now 3.015");
  fs::remove(desk.path("out/checkpoint.h5"));
  refused(desk.perikit("check next.toml"), "bonds were cut or had failed that are whole in this scene");
  // Without the field nobody knows.
  const Desk silent(torn("frames = 5\nfields = [\"displacement\"]"));
  REQUIRE(silent.perikit("run scene.toml --quiet -o out").status == 0);
  silent.write("next.toml", torn() + "[initial]\nfrom = \"out/results.h5\"\n");
  refused(silent.perikit("check next.toml"), "without a checkpoint of its end");
}

TEST_CASE("going on: a crack of the earlier run must be there, and may be joined by others") {
  const std::string crack = "[[crack]]\nsegment = [[4, -1], [4, 2]]\n", from = "[initial]\nfrom = \"out/results.h5\"\n";
  const Desk desk(plate + crack);
  REQUIRE(desk.perikit("run scene.toml --quiet -o out").status == 0);
  desk.write("next.toml", plate + from);
  refused(desk.perikit("check next.toml"), "every [[crack]] of that run");
  desk.write("next.toml", plate + crack + from);
  CHECK(desk.perikit("check next.toml").status == 0);
  desk.write("next.toml", plate + crack + "[[crack]]\nsegment = [[4, 4], [4, 6]]\n" + from);
  CHECK(desk.perikit("check next.toml").status == 0);
}

TEST_CASE("going on: a run that has ended, or was stopped, is lengthened by --resume") {
  const Desk desk(replaced(plate, "history_every = 1", "history_every = 1\ncheckpoint_every = 25"));
  REQUIRE(desk.perikit("run scene.toml --quiet -o whole --set integrator.end_time=2.0 --set output.frames=10").status == 0);
  REQUIRE(desk.perikit("run scene.toml --quiet -o out").status == 0);
  const Result longer = desk.perikit("run scene.toml --quiet -o out --resume --set integrator.end_time=2.0");
  CHECK_MESSAGE(longer.status == 0, longer.err);
  CHECK_MESSAGE(contains(desk.text("out/run.log"), "the run ends at 2 s, not 1 s: 50 more steps"), desk.text("out/run.log"));
  // Frames keep their spacing.
  const std::vector<Frame> frames = read_frames(desk.path("out")), expected = read_frames(desk.path("whole"));
  REQUIRE(frames.size() == expected.size());
  for (std::size_t k = 0; k < frames.size(); ++k) {
    CHECK(frames[k].step == expected[k].step);
    for (std::size_t c = 0; c < 3 * points; ++c)
      CHECK(std::abs(frames[k].displacement[c] - expected[k].displacement[c]) <= 1e-12);
  }
  CHECK(lines(desk.text("out/history.csv")).size() == lines(desk.text("whole/history.csv")).size());
  // And from there it goes on as any other.
  CHECK(desk.perikit("run scene.toml --quiet -o out --resume --set integrator.end_time=2.0").status == 0);
  refused(desk.perikit("run scene.toml --quiet -o out --resume"),
          "found 1 s, but the run in out has come to 2 s; allowed: a later end");
  refused(desk.perikit("run scene.toml --quiet -o out --resume --set integrator.end_time=3.0 --set material.density=2"),
          "material.density");
}

TEST_CASE("going on: load steps that failed go on in smaller ones") {
  std::string scene = replaced(plate, "velocity = [0.1, \"free\"]", "displacement = [0.6, \"free\"]");
  scene = replaced(scene, "type = \"verlet\"\ntime_step = 0.02\nend_time = 1.0",
                   "type = \"newton\"\nsteps = 8\ncut_backs = 0\nmax_iterations = 3\ntolerance = 1e-10");
  scene = replaced(scene, "frames = 5", "checkpoint_every = 1");
  const Desk desk(scene);
  const Result failed = desk.perikit("run scene.toml --quiet -o out");
  const Result whole = desk.perikit("run scene.toml --quiet -o whole --set integrator.steps=64");
  REQUIRE_MESSAGE(whole.status == 0, whole.err);
  MESSAGE("8 steps: ", failed.status, " ", failed.err);
  if (failed.status == 0) {
    refused(desk.perikit("run scene.toml --quiet -o out --resume --set integrator.steps=64"), "has come to its end");
    return;
  }
  const Result on = desk.perikit("run scene.toml --quiet -o out --resume --set integrator.steps=64");
  CHECK_MESSAGE(on.status == 0, on.err);
  const Frame a = read_frames(desk.path("out")).back(), b = read_frames(desk.path("whole")).back();
  CHECK(a.time == 1.0);
  for (std::size_t c = 0; c < 3 * points; ++c) CHECK(std::abs(a.displacement[c] - b.displacement[c]) <= 1e-6);
}

TEST_CASE("going on: frames and history that were changed before the checkpoint are noticed") {
  const Desk desk(replaced(long_plate(), "end_time = 6.0", "end_time = 1.0"));
  REQUIRE(desk.perikit("run scene.toml --quiet -o whole").status == 0);
  const auto with_change = [&](const std::string& file, auto&& change) {
    fs::remove_all(desk.path("out"));
    fs::copy(desk.path("whole"), desk.path("out"), fs::copy_options::recursive);
    std::string text = desk.text("out/" + file);
    change(text);
    std::ofstream(desk.path("out/" + file), std::ios::binary) << text;
    refused(desk.perikit("run scene.toml --quiet -o out --resume"),
            "out/" + file + ": found other contents than the run wrote before its checkpoint");
  };
  with_change("frames/00000001.h5",
              [](std::string& text) { text[text.size() / 2] = static_cast<char>(text[text.size() / 2] ^ 1); });
  with_change("history.csv", [](std::string& text) {
    const std::size_t at = text.find("\n3,") + 3;  // a digit of the time in the second row
    char& digit = text[text.find_last_of("0123456789", text.find(',', at) - 1)];
    digit = digit == '7' ? '8' : '7';
  });
}

TEST_CASE("going on: results of another body are refused where it differs first") {
  const std::string from = "[initial]\nfrom = \"out/results.h5\"\n";
  const Desk desk(plate);
  REQUIRE(desk.perikit("run scene.toml --quiet -o out").status == 0);
  desk.write("next.toml", plate + from);
  CHECK(desk.perikit("check next.toml").status == 0);
  const auto other = [&](const std::string& options, const std::string& words) {
    const Result result = desk.perikit("check next.toml " + options);
    CHECK(result.status == 2);
    CHECK_MESSAGE(contains(result.err, "next.toml:"), result.err);
    CHECK_MESSAGE(contains(result.err, words), "no '", words, "' in ", result.err);
  };
  // As many points of half the size; points that are shifted, in another order, without their volumes, in space.
  other("--set body.lattice.spacing=0.5 --set body.lattice.upper=[4,2.5] --set 'sets.right=\"x > 3\"' --set 'sets.left=\"x < 1\"'",
        "results of another body: its point 0 lies at (0.5, 0.5, 0) and has 1 m^3, that of this scene lies at (0.25, 0.25, 0) and has 0.25 m^3");
  other("--set body.lattice.jitter=0.001", "results of another body: its point 0 lies at (0.5, 0.5, 0)");
  other("--set body.thickness=2", "its point 0 lies at (0.5, 0.5, 0) and has 1 m^3, that of this scene lies at (0.5, 0.5, 0) and has 2 m^3");
  other("--set body.lattice.lower=[0,0] --set body.lattice.upper=[5,8] --set 'sets.right=\"x > 3\"'", "its point 5 lies at (5.5, 0.5, 0)");
  // What is rounded otherwise is the same body.
  CHECK(desk.perikit("check next.toml --set body.lattice.spacing=1.00000000001").status == 0);
  // Results that have lost the body.
  fs::remove(desk.path("out/reference.h5"));
  refused(desk.perikit("check next.toml"), "reference.h5 beside it is missing or damaged");
}
