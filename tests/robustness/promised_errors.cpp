/// Messages that a user meets, by their words: what is refused says where, what was found and what is allowed; what fails says where and when.

#include <fstream>
#include <sstream>

#include "robustness/desk.hpp"

using namespace perikit::test;

namespace {

void check_said(const Result& result, int status, const std::vector<std::string>& words) {
  CHECK_MESSAGE(result.status == status, result.err);
  for (const std::string& word : words) CHECK_MESSAGE(contains(result.err, word), "no '", word, "' in\n", result.err);
}

}  // namespace

TEST_CASE("errors: combinations of parts that have no meaning are refused with what fits") {
  const Desk desk;
  const auto refused = [&](const std::string& options, const std::vector<std::string>& words) { check_said(desk.perikit("check scene.toml " + options), 2, words); };
  refused("--set 'kinematics={type=\"selective\",base={type=\"baqp\"}}' --set body.plane=stress",
          {"scene.toml:4:1: body: found a state of stress with kinematics \"selective\"", "allowed: plane = \"strain\""});
  refused("--set kinematics.type=selective", {"scene.toml:19:1: kinematics.base: found nothing; allowed: the name of a kinematics"});
  const std::string local = "--set 'kinematics={type=\"bond_associated\",force_state=\"local\"}' ";
  refused(local + "--set 'damage={type=\"critical_stretch\",stretch=0.1}'", {"damage: found with kinematics.force_state = \"local\"; allowed: \"variational\""});
  refused(local + "--set 'material={type=\"hypoelastic\",density=1,youngs_modulus=1,poisson_ratio=0.3}'",
          {"material.type: found \"hypoelastic\", a law whose stress depends on the path, with force_state = \"local\"", "allowed: a material without history"});
  refused("--set 'kinematics={type=\"baqp\",stabilization=\"silling\"}'",
          {"kinematics.stabilization: found 'silling' over baqp; allowed: over kinematics with one gradient per point"});
  refused("--set kinematics.type=ordinary --set 'material={type=\"neo_hookean\",density=1,shear_modulus=1}'", {"material: found shear_modulus only; allowed: exactly 2 of youngs_modulus, poisson_ratio"});
}

TEST_CASE("damage goes with gradients of order 2 and with laws whose stress depends on the path: bonds fail and the energies balance") {
  const Desk desk;
  for (const std::string options : {"--set kinematics.order=2", "--set 'material={type=\"hypoelastic\",density=1,youngs_modulus=1,poisson_ratio=0.3}'"}) {
    CAPTURE(options);
    const Result result = desk.perikit("run scene.toml --quiet -o out --set 'damage={type=\"critical_stretch\",stretch=0.02}' " + options);
    REQUIRE_MESSAGE(result.status == 0, result.err);
    std::ifstream history(desk.path("out/history.csv"));
    std::string line;
    std::vector<double> first, row;
    std::getline(history, line);
    CHECK(line.starts_with("step,time,time_step,strain_energy,kinetic_energy,external_work,dissipated_energy,"));
    while (std::getline(history, line)) {
      row.clear();
      std::istringstream cells(line);
      for (std::string cell; std::getline(cells, cell, ',');) row.push_back(std::stod(cell));
      if (first.empty()) first = row;
    }
    REQUIRE(row.size() >= 7);
    const auto stored = [](const std::vector<double>& r) { return r[3] + r[4] + r[6] - r[5]; };
    CHECK(row[6] > 0);
    CHECK(stored(row) == doctest::Approx(stored(first)).epsilon(2e-3));
  }
}

TEST_CASE("errors: an expression without a finite value names key and point") {
  const Desk desk;
  check_said(desk.perikit("check scene.toml --set 'material.shear_modulus=\"1/(x - 0.5)\"'"), 2,
             {"material.shear_modulus: found the expression \"1/(x - 0.5)\", which is inf at x = (0.5, 0.5, 0)", "allowed: finite values"});
  check_said(desk.perikit("check scene.toml --set 'sets.left=\"x < -1\"'"), 2, {"sets.left: found a condition that holds at no point"});
}

TEST_CASE("errors: a name that cannot be, a folder that is there, a part that is there") {
  const Desk desk;
  fs::create_directory(desk.path("my_law"));
  check_said(desk.perikit("new material my_law"), 2, {"my_law: exists already: nothing is written"});
  CHECK(fs::is_empty(desk.path("my_law")));
  for (const std::string name : {"3d", "My_law", "a__b", "../up", "law-2"}) {
    check_said(desk.perikit(fmt::format("new material {}", name)), 2, {fmt::format("'{}' is no name of a part; allowed: a-z, 0-9 and single _", name)});
  }
  check_said(desk.perikit("new material neo_hookean"), 2, {"there is a material 'neo_hookean' already (", "materials_neo_hookean.so): take another name"});
}

TEST_CASE("errors: a load that no state carries ends with the step, the load and why") {
  const std::string scene = replaced(replaced(plate, "[[boundary]]\nset = \"right\"\nvelocity = [0.1, \"free\"]\n", "[[load]]\nset = \"right\"\nforce = [1.0e6, 0]\n"),
                                     "type = \"verlet\"\ntime_step = 0.02\nend_time = 1.0\n", "type = \"newton\"\nsteps = 2\nmax_iterations = 3\n");
  const Desk desk(scene);
  check_said(desk.perikit("run scene.toml --quiet -o out"), 1, {"the run failed: newton: no equilibrium found beyond load parameter ", "the smallest step, ", "snap-through", "last good frame: "});
}

TEST_CASE("errors: a body that memory does not hold is one line" * doctest::skip(unlimited_addresses)) {
  const Desk desk(replaced(plate, "upper = [8, 5]", "upper = [3000, 3000]"));
  check_said(desk.perikit("run scene.toml --quiet -o out --threads 1", "ulimit -v 1000000;"), 1,
             {"the run failed: not enough memory\n"});
}

TEST_CASE("errors: a study of which nothing came to its end says why the first run failed") {
  const Desk desk;
  desk.write("study.toml",
             "format = 1\nscene = \"scene.toml\"\n[values]\nmaterial.density = [1.0, 2.0]\n[[quantity]]\nname = \"energy\"\nfrom "
             "= \"strain_energy\"\n");
  CHECK(desk.perikit("study study.toml --quiet -o good").status == 0);
  const std::string faster = "--set 'initial={velocity=[\"-60*(x > 4)\",0]}'";
  check_said(desk.perikit("study study.toml --quiet -o bad " + faster), 1,
             {"the run failed: no run of the study came to its end; the first: ", "inadmissible", "point "});
  // Of which some did: the others by name, also where nobody wants to hear of progress.
  desk.write("some.toml", replaced(desk.text("study.toml"), "[1.0, 2.0]", "[1.0, -1.0]"));
  check_said(desk.perikit("study some.toml --quiet -o some"), 1,
             {"the run failed: 1 of 2 runs of the study did not come to their end:\n  runs/1 (material.density = -1.0) refused: ", "density", "--keep-going"});
  const Result going = desk.perikit("study some.toml --quiet -o some --resume --keep-going");
  CHECK(going.status == 0);
  CHECK(going.err.find("1 of 2 runs of the study did not come to their end:") != std::string::npos);
}
