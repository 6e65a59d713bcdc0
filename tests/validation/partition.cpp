/// Several ranks in one process, each with a part of the body and the ghosts that it needs: the run of one rank, bit for bit.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <mutex>

#include "perikit/core/parallel.hpp"
#include "tests/contract/integrator_fixture.hpp"
#include "tests/thread_ranks.hpp"
#include "tests/validation/scenes.hpp"

using namespace perikit;
using namespace perikit::validation;

namespace {

struct Result {
  std::vector<double> displacement, force;  ///< 3 numbers for each point of the whole body, in input order
  std::vector<double> energies;             ///< of all steps
  std::int64_t steps = 0;
  int looks = std::numeric_limits<int>::max();  ///< of the rank that has looked least often for values that were on their way
};

/// The state of this rank's owned points, at their places in the whole body.
void collect(Simulation& simulation, Result& result) {
  BodyProblem& problem = simulation.problem();
  const Body& body = problem.body();
  for (const std::int32_t index : body.owned()) {
    const auto p = static_cast<std::size_t>(index), n = static_cast<std::size_t>(body.number(p));
    for (std::size_t c = 0; c < 3; ++c) {
      const bool in = c < static_cast<std::size_t>(problem.dimension());
      result.displacement[3 * n + c] = in ? problem.state().displacement().component(static_cast<int>(c))[p] : 0.0;
      result.force[3 * n + c] = in ? problem.state().internal_force().component(static_cast<int>(c))[p] : 0.0;
    }
  }
}

/// Opens all parts, once: ranks that are threads share the registry, which opens a library when a part of it is wanted first.
void open_parts() {
  static const bool opened = [] {
    for (const Kind kind : all_kinds)
      for (const std::string& name : registry().names(kind)) registry().describe(kind, name);
    return true;
  }();
  static_cast<void>(opened);
}

/// Runs the scene on so many ranks.
Result run_on(int ranks, const std::string& text) {
  INFO(ranks, " ranks");
  open_parts();
  Result result;
  std::mutex one;
  on_ranks(ranks, [&](ThreadRank& rank) {
    const auto simulation = contract::build(text);
    const contract::Watch watch = contract::run(*simulation);
    const std::lock_guard lock(one);
    const std::size_t numbers = 3 * simulation->problem().body().points_of_all_ranks();
    result.displacement.resize(numbers, std::nan(""));
    result.force.resize(numbers, std::nan(""));
    collect(*simulation, result);
    result.steps = simulation->problem().state().step;
    result.looks = std::min(result.looks, rank.looks);
    std::vector<double> energies;
    for (const Energies& e : watch.energies)
      energies.insert(energies.end(), {e.strain, e.kinetic, e.external_work, e.dissipated});
    if (!result.energies.empty()) CHECK(result.energies == energies);
    result.energies = energies;
    if (ranks == 1) return;
    CHECK(rank.exchanges > 0);
    CHECK(simulation->problem().body().points() > simulation->problem().body().owned().size());
  });
  return result;
}

contract::BodyOptions body_of(int dimension, bool cloud) {
  contract::BodyOptions body;
  body.dimension = dimension;
  body.cloud = cloud;
  body.two_materials = dimension > 1;
  body.cells = dimension == 3 ? 14 : dimension == 2 ? (cloud ? 40 : 22) : (cloud ? 900 : 60);
  body.horizon_ratio = dimension == 3 ? 2.015 : 2.515;
  body.material += "\ndensity = 1.0";
  body.sets = fmt::format("low = \"x < 1.5\"\nhigh = \"x > {}\"\n", body.cells - (dimension > 1 ? 2 : 0) - 1.5);
  const std::string load = dimension == 3 ? "[0.02, 0.01, 0.0]" : dimension == 2 ? "[0.02, 0.01]" : "[0.02]";
  const std::string fixed = dimension == 3 ? "[0, 0, 0]" : dimension == 2 ? "[0, 0]" : "[0]";
  body.conditions = fmt::format("[[boundary]]\nset = \"low\"\ndisplacement = {}\n[[load]]\nset = \"high\"\nforce = {}\n", fixed, load);
  return body;
}

bool same_bits(const std::vector<double>& a, const std::vector<double>& b) {
  return std::ranges::equal(a, b);
}

/// How often the ranks have looked for values that were on their way, those that did so least.
int compare(const std::string& text, const std::vector<int>& shares, bool breaks = false) {
  const int threads = thread_count();
  int looks = std::numeric_limits<int>::max();
  set_thread_count(1);
  const Result one = run_on(1, text);
  if (breaks) CHECK_MESSAGE(one.energies.back() > 0, "no bond has failed");
  for (const int ranks : shares) {
    const Result more = run_on(ranks, text);
    CHECK(more.steps == one.steps);
    looks = std::min(looks, more.looks);
    const double most = contract::largest(one.displacement);
    REQUIRE(most > 1e-7);
    CHECK_MESSAGE(same_bits(more.displacement, one.displacement), ranks, " ranks: off by ",
                  contract::difference(more.displacement, one.displacement) / most);
    CHECK_MESSAGE(same_bits(more.force, one.force), ranks, " ranks, forces: off by ",
                  contract::difference(more.force, one.force) / contract::largest(one.force));
    CHECK_MESSAGE(same_bits(more.energies, one.energies), ranks, " ranks, energies: off by ",
                  contract::difference(more.energies, one.energies) / contract::largest(one.energies));
  }
  set_thread_count(threads);
  return looks;
}

/// Every kinematics with its first examples, and stabilisations.
std::vector<std::string> kinematics_tables() {
  std::vector<std::string> tables;
  for (const std::string& name : registry().names(Kind::kinematics))
    for (const std::string& example : registry().describe(Kind::kinematics, name).examples) tables.push_back(fmt::format("type = \"{}\"\n{}", name, example));
  tables.push_back("type = \"conventional\"\nstabilization = { type = \"silling\", coefficient = 0.5 }");
  tables.push_back("type = \"conventional\"\nstabilization = { type = \"wan\" }");
  tables.push_back("type = \"bond_based\"\nsurface_correction = \"energy\"");
  return tables;
}

}  // namespace

TEST_CASE("partition: explicit runs on several ranks are those on one, bit for bit, for every kinematics") {
  for (const std::string& kinematics : kinematics_tables())
    for (const int dimension : {1, 2, 3})
      for (const bool cloud : {false, true}) {
        INFO(kinematics, ", ", dimension, "D ", std::string(cloud ? "cloud" : "lattice"));
        contract::BodyOptions body = body_of(dimension, cloud);
        // Gradients of order 2 on jittered clouds in space are stiff: shorter steps.
        body.integrator = dimension == 3 ? "type = \"verlet\"\nend_time = 0.06\ntime_step = 0.01"
                                         : "type = \"verlet\"\nend_time = 0.5\ntime_step = 0.05";
        compare(contract::scene_text(body, kinematics), dimension == 3 ? std::vector{2} : std::vector{2, 3});
      }
}

TEST_CASE("partition: while values of ghosts are on their way ranks evaluate what reads none, of every kinematics") {
  const std::string symmetry = "[[symmetry]]\naxis = \"y\"\n", energy = "[damage]\ntype = \"critical_energy\"\nenergy_release_rate = 0.1\n";
  for (const std::string& kinematics : kinematics_tables())
    for (const bool cloud : {false, true})
      for (const std::string& more : {std::string(), symmetry, energy}) {
        if (more == energy && kinematics.find("local") != std::string::npos) continue;  // has no energy
        INFO(kinematics, ", ", std::string(cloud ? "cloud" : "lattice"), ", ", more);
        contract::BodyOptions body = body_of(2, cloud);
        body.cells = 60;
        body.conditions = "[initial]\nvelocity = [\"0.01 * cos(x/7)\", \"0.01 * sin(y/7)\"]\n" + more;
        body.integrator = "type = \"verlet\"\nend_time = 0.1\ntime_step = 0.05";
        // Rows of a lattice lie along the longest axis, and images then fill rows of their own.
        std::string text = contract::scene_text(body, kinematics);
        text.replace(text.find("upper = [58,"), 12, "upper = [120,");
        CHECK(compare(text, {2}) > 0);
      }
}

TEST_CASE("partition: bonds fail on several ranks as on one, bit for bit, with their fragments and energies") {
  const std::string criterion = "[damage]\ntype = \"critical_stretch\"\nstretch = 0.02\n",
                    smooth = "[damage]\ntype = \"smooth_degradation\"\nstretch_min = 0.01\nstretch = 0.05\n";
  for (const std::string& kinematics :
       {std::string("type = \"bond_based\""), std::string("type = \"ordinary\""), std::string("type = \"baqp\""),
        std::string("type = \"bond_associated\""), std::string("type = \"conventional\"\nstabilization = { type = \"wan\" }")})
    for (const std::string& damage : {criterion, criterion + "gradual = true\n", smooth})
      for (const bool cloud : {false, true}) {
        INFO(kinematics, ", ", damage, std::string(cloud ? "cloud" : "lattice"));
        contract::BodyOptions body = body_of(2, cloud);
        body.crack = true;
        body.conditions += "[initial]\nvelocity = [\"0.15*(x - 12)/12\", \"0.1*sin(x/3)*(y - 9)/9\"]\n" + damage;
        body.integrator = "type = \"verlet\"\nend_time = 3.0\ntime_step = 0.1";
        compare(contract::scene_text(body, kinematics), {2, 3}, true);
      }
}

TEST_CASE("partition: bonds stay on several ranks as on one, bit for bit") {
  for (const std::string kinematics : {"type = \"conventional\"", "type = \"baqp\"", "type = \"sub_horizon\""})
    for (const std::string more : {"", "gradual = true\n"})
      for (const bool cloud : {false, true}) {
        INFO(kinematics, ", ", more, std::string(cloud ? "cloud" : "lattice"));
        contract::BodyOptions body = body_of(2, cloud);
        body.crack = true;
        body.conditions +=
            "[initial]\nvelocity = [\"0.15*(x - 12)/12\", \"0.1*sin(x/3)*(y - 9)/9\"]\n[damage]\ntype = "
            "\"critical_stretch\"\nstretch = 0.02\n"
            "second_law = true\n" +
            more;
        body.integrator = "type = \"verlet\"\nend_time = 3.0\ntime_step = 0.1";
        compare(contract::scene_text(body, kinematics), {2, 3}, true);
      }
}

TEST_CASE("partition: laws with history on several ranks are those on one, bit for bit") {
  for (const std::string& kinematics :
       {std::string("type = \"conventional\""), std::string("type = \"baqp\""), std::string("type = \"sub_horizon\"")})
    for (const bool cloud : {false, true}) {
      INFO(kinematics, ", ", std::string(cloud ? "cloud" : "lattice"));
      contract::BodyOptions body = body_of(2, cloud);
      body.material = "type = \"hypoelastic\"\nyoungs_modulus = 2.0\npoisson_ratio = 0.3\ndensity = 1.0";
      body.two_materials = false;
      body.integrator = "type = \"verlet\"\nend_time = 1.5\ntime_step = 0.05";
      compare(contract::scene_text(body, kinematics), {2, 3});
    }
}

TEST_CASE("partition: tractions and pressures on several ranks, beside planes of symmetry and periodic sides, are those on one") {
  const std::string traction = "[[load]]\nset = \"high\"\nface = \"+x\"\ntraction = [0.02, 0.01]\n",
                    pressure = "[[load]]\nset = \"all\"\npressure = 0.02\nfollower = true\n", symmetry = "[[symmetry]]\naxis = \"y\"\n",
                    periodic = "[[periodic]]\naxis = \"y\"\n";
  for (const std::string& load : {traction, pressure})
    for (const std::string& beyond : {std::string(), symmetry, periodic})
      for (const bool cloud : {false, true}) {
        INFO(load, beyond, std::string(cloud ? "cloud" : "lattice"));
        contract::BodyOptions body = body_of(2, cloud);
        body.two_materials = false;
        body.conditions = body.conditions.substr(0, body.conditions.find("[[load]]")) + load + beyond;
        body.integrator = "type = \"verlet\"\nend_time = 0.5\ntime_step = 0.05";
        compare(contract::scene_text(body, "type = \"baqp\""), {2, 3});
      }
}

TEST_CASE("partition: statics without a matrix on several ranks is that on one") {
  for (const std::string integrator :
       {"type = \"jfnk\"\npreconditioner = \"none\"\nsteps = 1\ntolerance = 1e-9", "type = \"jfnk\"\npreconditioner = \"companion\"\nsteps = 2\ntolerance = 1e-9",
        "type = \"kinsol\"\npreconditioner = \"companion\"\nsteps = 1\ntolerance = 1e-9", "type = \"kinsol\"\nstrategy = \"fixed_point\"\nsteps = 1\ntolerance = 1e-2\nmax_iterations = 4000",
        "type = \"dynamic_relaxation\"\nsteps = 1\ntolerance = 1e-3"})
    for (const bool cloud : {false, true}) {
      INFO(integrator, ", ", std::string(cloud ? "cloud" : "lattice"));
      contract::BodyOptions body = body_of(2, cloud);
      body.material = "type = \"saint_venant_kirchhoff\"\nyoungs_modulus = 2.0\npoisson_ratio = 0.3";
      body.integrator = integrator;
      compare(contract::scene_text(body, "type = \"baqp\""), {2, 3});
    }
}

TEST_CASE("partition: the companion of a body in space, of one held at a face, and of one that is cracked, is that of one rank") {
  for (const bool cloud : {false, true})
    for (const std::string what : {"space", "face", "crack"}) {
      INFO(what, ", ", std::string(cloud ? "cloud" : "lattice"));
      contract::BodyOptions body = body_of(what == "space" ? 3 : 2, cloud);
      body.material = "type = \"saint_venant_kirchhoff\"\nyoungs_modulus = 2.0\npoisson_ratio = 0.3";
      body.integrator = "type = \"jfnk\"\npreconditioner = \"companion\"\nsteps = 1\ntolerance = 1e-9";
      body.crack = what == "crack";
      if (what == "face") {
        const std::string held = "set = \"low\"\n";
        body.conditions.replace(body.conditions.find(held), held.size(), "face = \"-x\"\n");
      }
      compare(contract::scene_text(body, "type = \"baqp\""), what == "space" ? std::vector{2} : std::vector{2, 3});
    }
}

TEST_CASE("partition: mixed systems of displacements and pressures on several ranks are those on one") {
  struct Variant {
    std::string base;
    double bulk;       // beyond 1000 shear moduli other equations for pressures
    std::string what;  // space, face, symmetry, periodic, bonds
  };
  for (const auto& [base, bulk, what] :
       {Variant{"baqp", 300, ""}, Variant{"projection", 5000, ""}, Variant{"bond_associated", 300, "symmetry"}, Variant{"baqp", 5000, "face"},
        Variant{"sub_horizon", 300, "periodic"}, Variant{"baqp", 300, "bonds"}, Variant{"baqp", 300, "space"}})
    for (const bool cloud : {false, true}) {
      INFO(base, ", bulk modulus ", bulk, ", ", what, " ", std::string(cloud ? "cloud" : "lattice"));
      contract::BodyOptions body = body_of(what == "space" ? 3 : 2, cloud);
      body.material = fmt::format("type = \"neo_hookean\"\nshear_modulus = 1.0\nbulk_modulus = {}", bulk);
      body.two_materials = false;
      body.crack = what == "bonds";
      body.integrator = fmt::format("type = \"jfnk\"\npreconditioner = \"{}\"\nsteps = {}\ntolerance = 1e-7", what == "space" ? "auto" : "mixed", what == "bonds" ? 2 : 1);
      if (what == "symmetry") body.conditions += "[[symmetry]]\naxis = \"y\"\n";
      if (what == "periodic") body.conditions += "[[periodic]]\naxis = \"y\"\n";
      const auto replace = [&](const std::string& text, const std::string& other) {
        body.conditions.replace(body.conditions.find(text), text.size(), other);
      };
      // Bonds fail at a crack, by a motion that does not tear the body apart.
      if (what == "bonds") {
        body.conditions.resize(body.conditions.find("[[load]]"));
        body.conditions += "[[boundary]]\nset = \"high\"\ndisplacement = [0.6, 0]\n[damage]\ntype = \"critical_stretch\"\nstretch = 0.06\n";
      } else {
        replace("force = [0.02, 0.01", "force = [2.0, 1.0");
      }
      if (what == "face") replace("set = \"low\"\n", "face = \"-x\"\n");
      compare(contract::scene_text(body, fmt::format("type = \"selective\"\nbase = \"{}\"", base)), what == "space" ? std::vector{2} : std::vector{2, 3},
              what == "bonds");
    }
}

TEST_CASE("partition: a body that nothing holds is refused on several ranks, too") {
  contract::BodyOptions body = body_of(2, false);
  body.conditions = body.conditions.substr(body.conditions.find("[[load]]"));
  body.integrator = "type = \"jfnk\"\nsteps = 1";
  for (const int ranks : {1, 2, 3})
    CHECK_THROWS_WITH(run_on(ranks, contract::scene_text(body, "type = \"baqp\"")), doctest::Contains("found nothing that holds the body"));
}

TEST_CASE("partition: what needs the whole body on one rank says so") {
  contract::BodyOptions body = body_of(2, false);
  body.integrator = "type = \"newton\"\nsteps = 1";
  CHECK_THROWS_WITH(run_on(2, contract::scene_text(body, "type = \"conventional\"")),
                    doctest::Contains("found \"newton\" on 2 ranks; allowed: integrators that need no matrix"));
  for (const std::string matrix : {"type = \"jfnk\"\npreconditioner = \"factorisation\"", "type = \"kinsol\"\npreconditioner = \"jacobi\"", "type = \"kinsol\"\nlinear_solver = \"klu\""}) {
    body.integrator = matrix + "\nsteps = 1";
    CHECK_THROWS_WITH(run_on(2, contract::scene_text(body, "type = \"conventional\"")), doctest::Contains("on 2 ranks; allowed: integrators that need no matrix"));
  }
}
