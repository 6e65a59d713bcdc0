/// What a scene does not need costs nothing: counted inside the program, not timed, and without changing a bit of the result.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <string_view>

#include "perikit/model/point_term.hpp"
#include "perikit/body/influence.hpp"
#include "scene/scene.hpp"
#include "tests/contract/integrator_fixture.hpp"
#include "tests/kit/observers.hpp"
#include "tests/kit/scene_text.hpp"
#include "tests/validation/scenes.hpp"

using namespace perikit;
using namespace perikit::validation;

namespace {

/// Evaluation points that asked for something, over a whole run.
struct Work {
  std::atomic<std::int64_t> energies{0}, stresses{0}, tangents{0}, outside{0};   ///< outside: of another space than plane strain
};

/// A law that counts what it is asked for.
class CountedMaterial final : public Material {
 public:
  CountedMaterial(std::unique_ptr<Material> law, Work& work) : law_(std::move(law)), work_(work) {}
  MaterialTraits traits() const noexcept override { return law_->traits(); }
  void constants(const MaterialInput& input, double* out) const override { law_->constants(input, out); }
  Moduli small_strain(const double* k) const noexcept override { return law_->small_strain(k); }
  std::span<const StateVariable> state(Space space) const noexcept override { return law_->state(space); }
  Status evaluate(Space space, const MaterialBatch& batch) const noexcept override {
    if (batch.psi) work_.energies += batch.n;
    if (batch.P) work_.stresses += batch.n;
    if (batch.A) work_.tangents += batch.n;
    if (space != Space::plane_strain) work_.outside += batch.n;
    return law_->evaluate(space, batch);
  }

 private:
  std::unique_ptr<Material> law_;
  Work& work_;
};

/// The parts of this build, their laws counted.
class Counting final : public PartFactory {
 public:
  std::unique_ptr<Kinematics> kinematics(const PartValues& part) const override { return registry().kinematics(part); }
  std::unique_ptr<Stabilization> stabilization(const PartValues& part) const override { return registry().stabilization(part); }
  std::unique_ptr<Material> material(const PartValues& part) const override {
    return std::make_unique<CountedMaterial>(registry().material(part), work);
  }
  std::unique_ptr<Damage> damage(const PartValues& part) const override { return registry().damage(part); }
  std::unique_ptr<InfluenceFunction> influence(const PartValues& part) const override { return registry().influence(part); }
  std::unique_ptr<PointTerm> term(const PartValues& part) const override { return registry().term(part); }
  std::unique_ptr<Integrator> integrator(const PartValues& part) const override { return registry().integrator(part); }
  mutable Work work;
};

/// One simulation with its counts.
struct Run {
  Run(const std::string& text, std::vector<std::string> overrides) {
    simulation = std::make_unique<Simulation>(parse_scene(text, "skipping.toml", registry(), {.overrides = std::move(overrides)}), counting);
  }
  BodyProblem& problem() { return simulation->problem(); }
  std::vector<double> end() {
    contract::run(*simulation);
    return contract::state(*simulation);
  }
  Counting counting;
  std::unique_ptr<Simulation> simulation;
};

/// A long bar whose left end is pushed.
const std::string bar = test::SceneText{.dimension = 1, .space = "", .spacing = 1e-3, .upper = {4}, .sets = "left = \"x < 3e-3\"", .family = "horizon_ratio = 3.015\ninfluence = \"gaussian\"",
                                        .material = "type = \"neo_hookean\"\ndensity = 1000.0\nshear_modulus = 1e6\nbulk_modulus = 2e6",
                                        .further = "[[boundary]]\nset = \"left\"\ndisplacement = [\"1e-4 * sin(1e3*t)\"]", .integrator = "type = \"verlet\"\nend_time = 1.5e-3"};

/// A long notched strip that flies apart. Bonds near the notch fail, some of them in most steps.
const std::string tear = test::SceneText{.spacing = 0.1, .upper = {12, 2.4}, .lattice = "seed = 5", .sets = "far = \"abs(x - 6) > 1\"", .family = "horizon_ratio = 2.015\ninfluence = \"constant\"",
                                         .material = "type = \"saint_venant_kirchhoff\"\ndensity = 1000.0\nyoungs_modulus = 1e6\npoisson_ratio = 0.3",
                                         .further = "[[crack]]\nsegment = [[6, -1], [6, 0.8]]\n[damage]\ntype = \"critical_stretch\"\nstretch = 0.02\nno_fail = [\"far\"]\n"
                                                    "[initial]\nvelocity = [\"0.5*(x - 6)\", 0]\n[output]\nhistory_every = 20",
                                         .integrator = "type = \"verlet\"\nend_time = 0.048\nsafety = 0.15"};

/// A strip that is pulled in equal load steps.
const std::string strip = test::SceneText{.spacing = 0.1, .upper = {2, 1}, .sets = "left = \"x < 0.1\"\nright = \"x > 1.9\"", .family = "horizon_ratio = 2.015\ninfluence = \"gaussian\"",
                                          .kinematics = "projection", .material = "type = \"linear_elastic\"\nyoungs_modulus = 1.0\npoisson_ratio = 0.3",
                                          .further = "[[boundary]]\nset = \"left\"\ndisplacement = [0, 0]\n[[boundary]]\nset = \"right\"\ndisplacement = [0.02, 0]",
                                          .integrator = "type = \"newton\"\nsteps = 5"};

}  // namespace

TEST_CASE("skipping: points that no wave has reached are not evaluated, and the run is the same, bit for bit") {
  for (const std::string kinematics : {"conventional", "baqp", "non_spherical", "ordinary"}) {
    for (const std::string jitter : {"0.0", "0.2"}) {
      INFO(kinematics, ", jitter ", jitter);
      const std::vector<std::string> body = {"kinematics=" + kinematics, "body.lattice.jitter=" + jitter};
      const auto run = [&](const char* skip) {
        std::vector<std::string> all = body;
        all.push_back(std::string("run.skip=") + skip);
        return Run(bar, all);
      };
      Run some = run("true"), every = run("false");
      const std::vector<double> end = some.end(), expected = every.end();
      CHECK(end == expected);
      const RestingCounts quiet = some.problem().report().resting;
      CHECK_MESSAGE(quiet.quiet > quiet.blocks / 4, quiet.quiet, " of ", quiet.blocks, " blocks left out");
      CHECK(every.problem().report().resting.blocks == 0);
      if (kinematics != "ordinary")
        CHECK_MESSAGE(some.counting.work.stresses < 0.75 * static_cast<double>(every.counting.work.stresses), some.counting.work.stresses.load(), " of ",
                      every.counting.work.stresses.load(), " evaluation points");
    }
  }
}

TEST_CASE("skipping: when bonds have failed, forces are renewed near them alone, and the run is the same, bit for bit") {
  const std::vector<std::string> every_kinematics = {R"("conventional")",
                                                     R"({type="conventional",stabilization="silling"})",
                                                     R"({type="conventional",stabilization="wan"})",
                                                     R"({type="conventional",order=2,stabilization="silling"})",
                                                     R"("baqp")",
                                                     R"({type="projection",order=2})",
                                                     R"("bond_augmented")",
                                                     R"("sub_horizon")",
                                                     R"("bond_associated")",
                                                     R"("bond_based")",
                                                     R"("ordinary")",
                                                     R"({type="selective",base="baqp"})",
                                                     R"({type="selective",base="bond_associated"})"};
  for (const std::string& kinematics : every_kinematics)
    for (const std::string jitter : {"0.0", "0.2"}) {
      if (jitter != "0.0" && (kinematics.find("order") != std::string::npos || kinematics.find("base=\"bond") != std::string::npos)) continue;
      INFO(kinematics, ", jitter ", jitter);
      const auto run = [&](const char* skip) {
        return Run(tear, {"kinematics=" + kinematics, "body.lattice.jitter=" + jitter, std::string("run.skip=") + skip, "family.consistent=false"});
      };
      Run some = run("true"), every = run("false");
      const std::vector<double> end = some.end(), expected = every.end();
      CHECK(end == expected);
      CHECK(some.problem().fracture()->checks().failed >= 18);
      // Points of a cloud are evaluated 64 at a time.
      if (some.counting.work.stresses > 0 && (jitter == "0.0" || kinematics.find("conventional") == std::string::npos))
        CHECK_MESSAGE(some.counting.work.stresses < every.counting.work.stresses, some.counting.work.stresses.load(), " of ",
                      every.counting.work.stresses.load(), " evaluation points");
    }
}

namespace {

/// A block that is shaken until bonds fail.
std::string shaken(int dimension, const std::string& kinematics, const std::string& damage, const std::string& more = "") {
  const bool plane = dimension == 2;
  return fmt::format("format = 1\nkinematics = {}\n[body]\ndimension = {}\n{}[body.lattice]\nspacing = 0.02\nlower = [{}]\nupper = [{}]\n{}\n", kinematics,
                     dimension, plane ? "plane = \"strain\"\n" : "", plane ? "0, 0" : "0, 0, 0", plane ? "0.16, 0.22" : "0.12, 0.1, 0.08", more) +
         fmt::format("[family]\nhorizon_ratio = {}\n[material]\ntype = \"neo_hookean\"\ndensity = 174.0\nyoungs_modulus = 14000.0\npoisson_ratio = 0.3\n", plane ? "2.515" : "2.015") +
         fmt::format("[initial]\nvelocity = [\"0.025*sin(19*x + 12*y + 1.6)\", \"-0.023*sin(10*x - 5*y - 2.5)\"{}]\n", plane ? "" : ", \"0.02*sin(14*z - 9*x)\"") +
         fmt::format("[damage]\n{}\n[integrator]\ntype = \"verlet\"\nend_time = {}\n[output]\nframes = 1\n", damage, plane ? "0.1" : "0.06");
}

}  // namespace

TEST_CASE("skipping: the same bonds fail, bit for bit, whatever bonds fail by") {
  const std::string released = "type = \"critical_energy\"\nenergy_release_rate = 0.002\n", bare = "\"conventional\"";
  struct Case {
    int dimension;
    std::string kinematics, damage, more;
  };
  std::vector<Case> cases{{2, bare, released + "softening = 4.0", ""},
                          {2, bare, released + "second_law = false", ""},
                          {3, bare, released, ""},
                          {3, "\"bond_augmented\"", released, ""},
                          {2, "\"bond_augmented\"", released + "softening = 4.0\nsecond_law = false", ""},
                          {2, "\"baqp\"", released + "softening = 2.0", ""},
                          {3, "\"baqp\"", released, ""},
                          {2, "\"projection\"", released + "gradual = true", ""},
                          {2, "{type=\"conventional\",stabilization=\"silling\"}", released, ""},
                          {2, "{type=\"conventional\",stabilization=\"wan\"}", released + "softening = 4.0", ""},
                          {2, "\"sub_horizon\"", released, ""},
                          {2, "\"bond_associated\"", released, ""},
                          {2, "{type=\"selective\",base=\"baqp\"}", released, ""},
                          {2, "{type=\"conventional\",order=2}", released, ""},
                          {2, "\"baqp\"", released + "energy = \"held\"", ""},
                          {2, "{type=\"conventional\",stabilization=\"silling\"}", released + "energy = \"held\"\nsoftening = 4.0", ""},
                          {2, "\"bond_based\"", released + "softening = 4.0", ""},
                          {2, "\"ordinary\"", released, ""},
                          {2, "\"baqp\"", "type = \"max_stress\"\nstrength = 25.0", ""},
                          {2, "\"projection\"", "type = \"smooth_degradation\"\nstretch_min = 0.001\nstretch = 0.004", ""}};
  cases.push_back({2, "\"ordinary\"", released + "softening = 2.0", "jitter = 0.1"});   // dilatations with bonds that have weakened
  for (const std::string kinematics : {"\"conventional\"", "\"baqp\"", "\"bond_augmented\""}) cases.push_back({2, kinematics, released, "jitter = 0.1"});
  for (const Case& c : cases) {
    INFO(c.dimension, "D ", c.kinematics, ", ", c.damage, ", ", c.more);
    const std::string text = shaken(c.dimension, c.kinematics, c.damage, c.more);
    Run some(text, {"run.skip=true"}), every(text, {"run.skip=false"});
    const std::vector<double> end = some.end(), expected = every.end();
    CHECK(end == expected);
    const BondChecks checks = some.problem().fracture()->checks();
    CHECK(checks.failed + checks.weakened > 0);
    const auto same = [](const BondChange& a, const BondChange& b) { return a.bond == b.bond && a.integrity == b.integrity; };
    CHECK(std::ranges::equal(some.problem().families().changed(), every.problem().families().changed(), same));
  }
}

TEST_CASE("skipping: points held at rest have no forces beyond the reach of free points, and the reactions are the same, bit for bit") {
  const std::vector<std::string> held = {"sets={left=\"x < 3e-3\",right=\"x > 1\"}",
                                         "boundary=[{set=\"left\",displacement=[\"1e-4 * sin(1e3*t)\"]},{set=\"right\",displacement=[0]}]"};
  for (const std::string kinematics : {"conventional", "baqp", "sub_horizon", "bond_based"}) {
    INFO(kinematics);
    // Four times as long as a wave needs through the free quarter of the bar.
    const auto run = [&](const char* skip) {
      std::vector<std::string> all = held;
      all.insert(all.end(), {"kinematics=" + kinematics, "integrator.end_time=0.08", std::string("run.skip=") + skip});
      return Run(bar, all);
    };
    Run some = run("true"), every = run("false");
    const std::vector<double> end = some.end(), expected = every.end();
    CHECK(end == expected);
    CHECK(contract::largest(some.problem().body(), some.problem().state().displacement()) > 0);
    const FieldView force = some.problem().state().internal_force(), same = every.problem().state().internal_force();
    CHECK(std::equal(force.data, force.data + force.size(), same.data));
    CHECK(some.problem().constraints().points_held_at_rest() == 3000);
    const RestingCounts quiet = some.problem().report().resting;
    CHECK_MESSAGE(2 * quiet.quiet > quiet.blocks, quiet.quiet, " of ", quiet.blocks, " blocks left out");
    CHECK(some.simulation->explanation(registry()).find("points held at rest: no wave ever reaches them") != std::string::npos);
  }
}

TEST_CASE("skipping: energies are only summed where history samples") {
  /// Samples one step in ten.
  class Sparse final : public test::Silent {
   public:
    bool wants_sample(std::int64_t step, double) override { return step % 10 == 0; }
  };
  Run sparse(bar, {"body.lattice.upper=[0.2]"}), full(bar, {"body.lattice.upper=[0.2]"});
  Sparse observer;
  sparse.simulation->run(observer);
  CHECK(contract::displacement(*sparse.simulation) == [&] { full.end(); return contract::displacement(*full.simulation); }());
  CHECK(full.counting.work.energies > 0);
  CHECK(sparse.counting.work.energies < 0.15 * static_cast<double>(full.counting.work.energies));
}

TEST_CASE("skipping: a bond of a symmetric kinematics is evaluated once for both ends") {
  Run shared(bar, {"run.skip=false", "body.lattice.upper=[0.2]"}), plain(bar, {"run.skip=false", "run.share=false", "body.lattice.upper=[0.2]"});
  const std::vector<double> end = shared.end(), expected = plain.end();
  CHECK(contract::difference(end, expected) <= 1e-11 * contract::largest(expected));
  CHECK(static_cast<double>(shared.counting.work.stresses) < 0.6 * static_cast<double>(plain.counting.work.stresses));
}

TEST_CASE("skipping: a constant stiffness is assembled and factorised once") {
  Run linear(strip, {}), curved(strip, {"material.type=\"saint_venant_kirchhoff\""});
  const std::size_t points = linear.problem().report().evaluation_points;
  linear.end();
  curved.end();
  // `projection` gives W A of each evaluation point once; batches are padded.
  CHECK(linear.counting.work.tangents > 0);
  CHECK(linear.counting.work.tangents <= static_cast<std::int64_t>(2 * points));
  CHECK(curved.counting.work.tangents > 5 * linear.counting.work.tangents);
}

TEST_CASE("skipping: a plane scene evaluates plane laws only, and statics have no velocity") {
  Run run(strip, {});
  run.end();
  CHECK(run.counting.work.stresses + run.counting.work.tangents > 0);
  CHECK(run.counting.work.outside == 0);
  const std::vector<std::byte> state = run.problem().snapshot();
  CHECK(std::string_view(reinterpret_cast<const char*>(state.data()), state.size()).find("velocity") == std::string_view::npos);
}

TEST_CASE("skipping: without damage there is no state of bonds, and lattices store no families") {
  const auto bytes = [](const std::string& kinematics, const std::string& damage, double& per_point) {
    std::vector<std::string> overrides = {"body.dimension=3", "body.lattice.lower=[0, 0, 0]", "body.lattice.upper=[0.064, 0.064, 0.064]",
                                          "boundary=[]", "kinematics=" + kinematics};
    if (!damage.empty()) overrides.push_back("damage=" + damage);
    const Run run(bar, overrides);
    const Body& body = run.simulation->problem().body();
    run.simulation->problem().state().velocity();
    run.simulation->problem().masses().by_point();
    per_point = static_cast<double>(run.simulation->problem().bytes()) / static_cast<double>(body.points());
    return run.simulation->problem().report();
  };
  double intact = 0, failing = 0;
  const ModelReport report = bytes("conventional", "", intact);
  bytes("conventional", "{ type = \"critical_stretch\", stretch = 0.1 }", failing);
  CHECK_MESSAGE(intact < 400, intact, " bytes a point");
  CHECK(failing - intact >= static_cast<double>(report.bonds) / 262144.0 / 8 / 2);
  CHECK_MESSAGE((bytes("baqp", "", intact), intact < 600), intact, " bytes a point");
  CHECK_MESSAGE((bytes("bond_based", "", intact), intact < 300), intact, " bytes a point");
}
