/// Explicit runs whose time step is too long: refused before they start, stopped where they lose their energy, warned of at the
/// end. Quasi-static runs whose strain energy is not the work that was done: warned of.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include "robustness/desk.hpp"

using namespace perikit::test;

namespace {

/// The longest stable step of the plate, as the refusal of a longer one states it.
double stable_step(const Desk& desk) {
  const std::string text = desk.perikit("check scene.toml --set integrator.time_step=100").err,
                    before = "the longest stable step at the start is ";
  REQUIRE_MESSAGE(contains(text, before), text);
  return std::stod(text.substr(text.find(before) + before.size()));
}

std::string step(double length) {
  return fmt::format(" --set integrator.time_step={:.17g}", length);
}

/// Neighbours that move against each other: close to the highest mode of the plate.
const std::string rattling = "[initial]\nvelocity = [\"0.001*sin(pi*x)*sin(pi*y)\", 0]\n[integrator]";

}  // namespace

TEST_CASE("energies: check and run refuse a time step above the stable one, unless the scene allows it") {
  const Desk desk;
  const double stable = stable_step(desk);
  for (const std::string command : {"check scene.toml", "run scene.toml --quiet -o out"}) {
    const Result refused = desk.perikit(command + step(1.02 * stable));
    CHECK(refused.status == 2);
    CHECK_MESSAGE(contains(refused.err, "integrator.time_step: found "), refused.err);
    CHECK_MESSAGE(contains(refused.err, "allow_unstable = true"), refused.err);
    CHECK_MESSAGE(!fs::exists(desk.path("out")), "a refused scene leaves a folder");
  }
  CHECK(desk.perikit("check scene.toml" + step(0.98 * stable)).status == 0);
  CHECK(desk.perikit("check scene.toml --set integrator.allow_unstable=true" + step(1.02 * stable)).status == 0);
  const Result allowed = desk.perikit("run scene.toml -o out --set integrator.allow_unstable=true --set integrator.end_time=3.0" +
                                      step(1.02 * stable));
  CHECK_MESSAGE(allowed.status == 0, allowed.err);
  CHECK_MESSAGE(contains(desk.text("out/run.log"), "allowed by allow_unstable"), desk.text("out/run.log"));
  const Result useless = desk.perikit(
      "check scene.toml --set integrator.allow_unstable=true --set "
      "'integrator={type=\"verlet\",end_time=1.0,allow_unstable=true}'");
  CHECK(useless.status == 2);
  CHECK_MESSAGE(contains(useless.err, "integrator.allow_unstable: found without time_step"), useless.err);
}

TEST_CASE("energies: a run that loses its energy ends with status 1 and the energies") {
  const Desk desk;
  const Result run =
      desk.perikit("run scene.toml --quiet -o out --set integrator.allow_unstable=true --set integrator.end_time=5000.0" +
                   step(1.1 * stable_step(desk)));
  CHECK(run.status == 1);
  CHECK_MESSAGE(contains(run.err, "the energies do not add up any more: strain "), run.err);
  CHECK_MESSAGE(contains(run.err, "last good frame: "), run.err);
  CHECK(contains(desk.text("out/run.log"), "the energies do not add up any more"));
}

TEST_CASE("energies: loads and motions that grow from zero have done no work after their first step, and run") {
  const std::string moved = "[[boundary]]\nset = \"right\"\nvelocity = [0.1, \"free\"]\n";
  for (const std::string growth : {"t", "t^2", "sin(3*t)", "1 - exp(-t)", "(t > 0.5 ? 1 : 0)"})
    for (const std::string acts :
         {"[[load]]\nset = \"right\"\nforce = [\"0.01*GROWTH\", 0]\n", "[[load]]\nset = \"all\"\nface = \"+x\"\npressure = \"0.01*GROWTH\"\nfollower = true\n",
          "[[boundary]]\nset = \"right\"\ndisplacement = [\"0.01*GROWTH\", \"free\"]\n"})
      for (const std::string rows : {"", " --set output.history_every=2"}) {
        const std::string with = replaced(acts, "GROWTH", growth);
        INFO(with, rows);
        const Desk desk(replaced(replaced(plate, moved, with), "end_time = 1.0", "end_time = 2.0"));
        const Result run = desk.perikit("run scene.toml --quiet -o out --threads 1" + rows);
        CHECK_MESSAGE(run.status == 0, run.err);
        // A step that is too long is found all the same, and soon: energies double from step to step.
        if (growth != "t" || !rows.empty()) continue;
        const Result unstable = desk.perikit("run scene.toml --quiet -o out --threads 1 --set integrator.allow_unstable=true --set "
                                             "integrator.end_time=2000.0" + step(1.5 * stable_step(desk)));
        CHECK_MESSAGE(unstable.status == 1, unstable.err);
        const std::string before = "the run failed: step ";
        REQUIRE_MESSAGE(contains(unstable.err, before), unstable.err);
        CHECK_MESSAGE(std::stod(unstable.err.substr(unstable.err.find(before) + before.size())) <= 60, unstable.err);
      }
}

TEST_CASE("energies: what a long but stable step does to the fastest motions is a warning, also after a stop") {
  const Desk desk(replaced(replaced(plate, "velocity = [0.1, \"free\"]", "velocity = [0, \"free\"]"), "[integrator]", rattling));
  const std::string warning = "warning: the energies were off by up to ";
  const double stable = stable_step(desk);
  const Result coarse = desk.perikit("run scene.toml -o coarse --set integrator.end_time=100.0" + step(0.95 * stable));
  CHECK_MESSAGE(coarse.status == 0, coarse.err);
  CHECK_MESSAGE(contains(coarse.out, warning), coarse.out);
  const Result fine = desk.perikit("run scene.toml -o fine --set integrator.end_time=100.0" + step(0.1 * stable));
  CHECK_MESSAGE(fine.status == 0, fine.err);
  CHECK_MESSAGE(!contains(fine.out, warning), fine.out);
}

TEST_CASE("energies: a body at rest, far from where it was, has none that could be lost") {
  const Desk desk(replaced(replaced(plate, "displacement = [0, 0]\n", "displacement = [1e6, 0.3]\n"),
                           "[[boundary]]\nset = \"right\"\nvelocity = [0.1, \"free\"]\n\n[integrator]",
                           "[initial]\ndisplacement = [1e6, 0.3]\n[integrator]"));
  const Result run = desk.perikit("run scene.toml -o out --set 'output.history=[]'");
  CHECK_MESSAGE(run.status == 0, run.err);
  CHECK_MESSAGE(contains(run.out, "warnings      none"), run.out);
}

TEST_CASE("energies: a quasi-static run that jumps from one equilibrium to another is warned of its energies, one that follows its path is not") {
  for (const std::string integrator : {"newton", "jfnk", "kinsol", "dynamic_relaxation"}) {
    INFO(integrator);
    std::string scene = replaced(plate, "type = \"verlet\"\ntime_step = 0.02\nend_time = 1.0",
                                 fmt::format("type = \"{}\"\nsteps = 3\ntolerance = 1e-6", integrator));
    scene = replaced(scene, "[[boundary]]\nset = \"right\"\nvelocity = [0.1, \"free\"]\n", "[[load]]\nset = \"right\"\nbody_force = [\"LOAD\", 0]\n");
    scene = scene.substr(0, scene.find("[output]"));
    const std::string warning = "warning: strain energy and the work of loads and boundaries were apart by up to ";
    // All of the load from the start: in a body that is all but linear its work is twice the strain energy.
    const Desk sudden(replaced(scene, "LOAD", "0.005 + 0*t")), gradual(replaced(scene, "LOAD", "0.005*t"));
    const Result jump = sudden.perikit("run scene.toml -o out"), path = gradual.perikit("run scene.toml -o out");
    REQUIRE_MESSAGE(jump.status == 0, jump.err);
    REQUIRE_MESSAGE(path.status == 0, path.err);
    REQUIRE_MESSAGE(contains(jump.out, warning), jump.out);
    const std::string share = jump.out.substr(jump.out.find(" J, ", jump.out.find(warning)) + 4);
    CHECK_MESSAGE(std::stod(share) == doctest::Approx(0.5).epsilon(0.03), share);
    CHECK_MESSAGE(contains(path.out, "warnings      none"), path.out);
  }
}

TEST_CASE("energies: load steps of a body that is held far from where it was are no jump") {
  std::string scene = replaced(plate, "type = \"verlet\"\ntime_step = 0.02\nend_time = 1.0", "type = \"newton\"\nsteps = 3\ntolerance = 1e-3");
  scene = replaced(scene, "displacement = [0, 0]\n", "displacement = [\"1e6\", \"0.3\"]\n");
  scene = replaced(scene, "[[boundary]]\nset = \"right\"\nvelocity = [0.1, \"free\"]\n", "[initial]\ndisplacement = [1e6, 0.3]\n");
  const Desk desk(scene.substr(0, scene.find("[output]")));
  const Result run = desk.perikit("run scene.toml -o out");
  REQUIRE_MESSAGE(run.status == 0, run.err);
  CHECK_MESSAGE(!contains(run.out, "the work of loads and boundaries were apart"), run.out);
}
