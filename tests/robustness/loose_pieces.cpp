/// Quasi-static runs of bodies of which a piece is free to move: refused with the piece named, or held by weak springs.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>

#include "robustness/desk.hpp"

using namespace perikit::test;

namespace {

/// The plate in load steps, held at the left, loaded at the right.
std::string loaded(const std::string& integrator) {
  std::string scene = replaced(plate, "velocity = [0.1, \"free\"]", "displacement = [\"free\", \"free\"]");
  scene = replaced(scene, "[[boundary]]\nset = \"right\"\ndisplacement = [\"free\", \"free\"]\n",
                   "[[load]]\nset = \"right\"\nforce = [0.01, 0.002]\n");
  scene = replaced(scene, "type = \"verlet\"\ntime_step = 0.02\nend_time = 1.0",
                   fmt::format("type = \"{}\"\nsteps = 2\ntolerance = 1e-6", integrator));
  return replaced(
      scene, "\nhistory = [ { name = \"pull\", set = \"right\", quantity = \"reaction\", component = \"x\", reduce = \"sum\" } ]",
      "");
}

const std::string held = "[[boundary]]\nset = \"left\"\ndisplacement = [0, 0]\n";
/// Cuts every bond between x < 4 and x > 4.
const std::string crack = "[[crack]]\nsegment = [[4, -1], [4, 6]]\n";

double largest(const Frame& frame, std::size_t first, std::size_t step) {
  double most = 0;
  for (std::size_t p = first; p < points; p += step)
    for (std::size_t c = 0; c < 3; ++c) most = std::max(most, std::abs(frame.displacement[3 * p + c]));
  return most;
}

void refused(const Desk& desk, const std::string& options, const std::string& piece) {
  for (const std::string command : {"check scene.toml", "run scene.toml --quiet -o out"}) {
    const Result result = desk.perikit(command + options);
    CHECK(result.status == 2);
    CHECK_MESSAGE(contains(result.err, "boundary: found nothing that holds " + piece + ": "), result.err);
    CHECK_MESSAGE(!fs::exists(desk.path("out")), "a refused scene leaves a folder");
  }
}

}  // namespace

TEST_CASE("loose pieces: every quasi-static integrator refuses a body that nothing holds, and a piece that a crack cuts off") {
  for (const std::string integrator : {"newton", "jfnk", "kinsol", "dynamic_relaxation"}) {
    INFO(integrator);
    const std::string scene = loaded(integrator);
    refused(Desk(replaced(scene, held, "")), "", "the body");
    refused(Desk(replaced(scene, held, "")), " --set 'material={type=\"linear_elastic\",youngs_modulus=1,poisson_ratio=0.25}'",
            "the body");
    refused(Desk(scene + crack), "", "a piece of 20 points about (6, 2.5, 0)");
    CHECK(Desk(scene).perikit("run scene.toml --quiet -o out").status == 0);
  }
}

TEST_CASE("loose pieces: what a boundary leaves free counts, also on planes of symmetry and periodic sides") {
  const std::string scene = loaded("newton");
  refused(Desk(replaced(scene, held, "[[boundary]]\nset = \"left\"\ndisplacement = [0, \"free\"]\n")), "",
          "the body");  // along y
  const std::string one_point = replaced(scene, "left = \"x < 2\"", "left = { nearest = [0.5, 2.5] }");
  refused(Desk(one_point), "", "the body");  // turns about it
  const std::string symmetric = replaced(scene, held, "[[symmetry]]\naxis = \"x\"\nat = 0.0\n");
  refused(Desk(symmetric), "", "the body");  // along y
  CHECK(Desk(replaced(scene, held, "[[symmetry]]\naxis = \"x\"\nat = 0.0\n[[symmetry]]\naxis = \"y\"\nat = 0.0\n"))
            .perikit("check scene.toml")
            .status == 0);
  const std::string sides = "[[periodic]]\naxis = \"x\"\nlower = 0.0\nupper = 8.0\n";
  refused(Desk(replaced(scene, held, sides)), "", "the body");  // translations
  const Result periodic = Desk(replaced(one_point, held, sides + held)).perikit("check scene.toml");
  CHECK_MESSAGE(periodic.status == 0, periodic.err);  // a periodic body does not turn
  // A single point beyond a gap.
  const Desk gap(replaced(scene, "upper = [8, 5]", "upper = [12, 5]\ninside = \"x < 8 || (x > 11 && y < 1)\""));
  refused(gap, "", "a piece of 1 point about (11.5, 0.5, 0)");
}

TEST_CASE("loose pieces: weak springs hold them, and are told of") {
  const double k = 1e-4;
  for (const std::string integrator : {"newton", "jfnk", "kinsol", "dynamic_relaxation"}) {
    INFO(integrator);
    const std::string scene =
        replaced(loaded(integrator), "set = \"right\"\nforce = [0.01, 0.002]", "set = \"left\"\nforce = [0.001, 0]") + crack;
    const Desk desk(replaced(scene, "left = \"x < 2\"", "left = \"x < 2\"\nmiddle = \"x > 2 && x < 4\""));
    const std::string springs = fmt::format(" --set run.weak_springs={} --set 'load=[{{set=\"middle\",force=[0.01,0]}}]'", k);
    const Result run = desk.perikit("run scene.toml -o out" + springs);
    REQUIRE_MESSAGE(run.status == 0, run.err);
    CHECK_MESSAGE(
        contains(run.out,
                 "nothing but weak springs (0.0001 of a point's stiffness) holds a piece of 20 points about (6, 2.5, 0)"),
        run.out);
    const Frame last = read_frames(desk.path("out")).back();
    CHECK(largest(last, 2, 8) > 1e-4);   // of the half that is held
    CHECK(largest(last, 6, 8) <= 1e-9);  // nothing acts on the other
  }
  // Loaded, it moves by force over stiffness: 20 springs of k (lambda + 2 mu) V/dx^2.
  const Desk desk(loaded("newton") + crack);
  const Result run =
      desk.perikit(fmt::format("run scene.toml -o out --set run.weak_springs={} --set "
                               "'load=[{{set=\"right\",body_force=[1e-8,0]}}]' --set 'sets.right=\"x > 4\"'",
                               k));
  REQUIRE_MESSAGE(run.status == 0, run.err);
  const double mu = 0.8, lambda = 2.0 - 2.0 / 3.0 * mu;
  CHECK(read_frames(desk.path("out")).back().displacement[3 * 6] ==
        doctest::Approx(1e-8 / (k * (lambda + 2 * mu))).epsilon(1e-6));
  const Result dynamic = Desk().perikit("check scene.toml --set run.weak_springs=1e-4");
  CHECK(dynamic.status == 2);
  CHECK_MESSAGE(contains(dynamic.err, "run.weak_springs: found with integrator \"verlet\""), dynamic.err);
}

TEST_CASE("loose pieces: a tangent that springs hold by no more than its rounding is a warning of newton, one that they hold is not") {
  const Desk desk(replaced(loaded("newton"), "force = [0.01, 0.002]", "force = [1e-9, 0]") + crack);
  const std::string warning = "warning: newton: the tangent is nearly singular";
  const Result hardly = desk.perikit("run scene.toml -o hardly --set run.weak_springs=3e-15");
  REQUIRE_MESSAGE(hardly.status == 0, hardly.err);
  CHECK_MESSAGE(contains(hardly.out, warning), hardly.out);
  CHECK(contains(desk.text("hardly/run.log"), warning));
  // Of springs weaker than that it is rounding, and the processor, that decides whether they hold at all; the log says so either way.
  desk.perikit("run scene.toml -o rounding --set run.weak_springs=1e-15");
  CHECK(contains(desk.text("rounding/run.log"), warning));
  const Result held_by_springs = desk.perikit("run scene.toml -o held --set run.weak_springs=1e-10");
  REQUIRE_MESSAGE(held_by_springs.status == 0, held_by_springs.err);
  CHECK_MESSAGE(!contains(held_by_springs.out, warning), held_by_springs.out);
}

TEST_CASE("loose pieces: a piece that failing bonds let go under load ends the run with its name, one without load does not") {
  const std::string scene = replaced(loaded("newton"), "steps = 2", "steps = 20") +
                            "[damage]\ntype = \"critical_stretch\"\nstretch = 0.05\nno_fail = [\"left\", \"right\"]\n";
  const Desk desk(scene);
  const Result torn = desk.perikit("run scene.toml --quiet -o out --set 'load=[{set=\"right\",force=[2,0]}]'");
  CHECK(torn.status == 1);
  CHECK_MESSAGE(contains(torn.err, "nothing holds a piece of "), torn.err);
  CHECK_MESSAGE(contains(torn.err, "and the loads move it"), torn.err);
  // Pulled by its ends, it comes apart, and both halves are held.
  const std::string grips =
      " --set load=[] --set 'boundary=[{set=\"left\",displacement=[0,0]},{set=\"right\",displacement=[2,0]}]'";
  const Result pulled = desk.perikit("run scene.toml --quiet -o pulled" + grips);
  CHECK_MESSAGE(pulled.status == 0, pulled.err);
}
