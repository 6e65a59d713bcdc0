/// The fracture tests of Partmann et al., sections 5.2 and 5.3, on coarse lattices: where the crack goes, and where the energy goes. A double
/// cantilever beam: what a crack costs.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "perikit/problem/motion.hpp"
#include "tests/contract/integrator_fixture.hpp"
#include "tests/validation/scenes.hpp"

using namespace perikit;
using namespace perikit::validation;

namespace {

/// What is missing in the balance at the end, and what bonds dissipated [J].
struct RunEnergies {
  double work, dissipated, missing;
};

RunEnergies run(Simulation& simulation) {
  const contract::Watch watch = contract::run(simulation);
  const Energies& e = watch.energies.back();
  return {e.external_work, e.dissipated, e.external_work - e.strain - e.kinetic - e.dissipated};
}

/// Largest damage of the points where `inside` holds.
template <class Inside>
double most_damage(BodyProblem& problem, Inside&& inside) {
  const Field damage = problem.terms().damage();
  double most = 0;
  for (const std::int32_t p : problem.body().internal())
    if (inside(problem.body().position(static_cast<std::size_t>(p)))) most = std::max(most, damage.data()[p]);
  return most;
}

/// What updates of bonds have raised the strain energy by [J].
double raised_by_updates(const contract::Watch& watch) {
  double raised = 0;
  for (std::size_t k = 1; k < watch.energies.size(); ++k) raised += std::max(0.0, watch.energies[k - 1].dissipated - watch.energies[k].dissipated);
  return raised;
}

/// At least this share of the energy at the start was dissipated, of which updates of bonds gave back no more than a share; and all of it is accounted for.
void check_dissipation(const contract::Watch& watch, double least, double most_raised) {
  const Energies start = watch.energies.front(), last = watch.energies.back();
  const double before = start.strain + start.kinetic;
  const double raised = raised_by_updates(watch);
  CHECK(last.dissipated > least * before);
  CHECK_MESSAGE(raised <= most_raised * last.dissipated, raised, " J raised, ", last.dissipated, " J dissipated");
  CHECK(std::abs(before + last.external_work - last.strain - last.kinetic - last.dissipated) <= 0.001 * before);
}

/// What a new crack in a beam of arms of five points took per area over Gc.
double cost_of_crack(const char* kinematics, double softening, const char* energy = "released") {
  const auto beam = load("fracture/double_cantilever.toml",
                         {"body.lattice.spacing=2e-3", "constants.dx=2e-3", "integrator.steps=40", "run.threads=1",
                          fmt::format("kinematics={}", kinematics), fmt::format("damage.softening={}", softening),
                          fmt::format("interface.0.damage.softening={}", softening), fmt::format("damage.energy={}", energy),
                          fmt::format("interface.0.damage.energy={}", energy)});
  const auto lost = [&] {
    const Field damage = beam->problem().terms().damage();
    double sum = 0;
    for (const std::int32_t p : beam->problem().body().set("lips")) sum += damage.data()[p];
    return sum;
  };
  const double before = lost(), dissipated = run(*beam).dissipated, grown = 0.03 * (lost() / before - 1);
  CHECK(grown > 0.01);
  return dissipated / (500 * grown);
}

}  // namespace

TEST_CASE("double cantilever beam: bonds that weaken take Gc per area, those that break at once what they set free too") {
  const double weakening = cost_of_crack("bond_based", 4), at_once = cost_of_crack("bond_based", 1);
  MESSAGE("dissipated per area over Gc: ", weakening, ", at once ", at_once);
  CHECK(weakening == doctest::Approx(1).epsilon(0.1));
  CHECK(at_once > 1.4);
}

TEST_CASE("double cantilever beam: with gradients bonds take Gc per area by the energy that they set free, and more by the one that they hold") {
  const double released = cost_of_crack("baqp", 4), held = cost_of_crack("baqp", 4, "held"), weighted = cost_of_crack("bond_associated", 4);
  MESSAGE("dissipated per area over Gc: by the energy set free ", released, " and ", weighted, ", held ", held);
  CHECK(released == doctest::Approx(1).epsilon(0.1));
  CHECK(weighted == doctest::Approx(1).epsilon(0.1));
  CHECK(held > 1.2);
}

TEST_CASE("compact tension: the specimen is as stiff as linear elastic fracture mechanics says, and its crack costs Gc per area") {
  // At twice the spacing, 600 points; framework/tools/compact_tension.py compares the loads.
  const auto specimen = load("fracture/compact_tension.toml", {"kinematics=bond_based", "body.lattice.spacing=2e-3", "constants.dx=2e-3", "run.threads=1",
                                                               "sets.upper_lip={nearest=[0,0.001]}", "sets.lower_lip={nearest=[0,-0.001]}"});
  BodyProblem& problem = specimen->problem();
  const auto of_set = [&](const char* set, const Field& field) {
    double sum = 0;
    for (const std::int32_t p : problem.body().set(set)) sum += field.component(field.components() - 1)[p];
    return sum;
  };
  double stiffness = 0, first_length = 0, first_dissipated = 0, length = 0, before = 0;
  contract::Watch watch(*specimen);
  watch.each = [&](const StepReport& report) {
    const double lost = of_set("lips", problem.terms().damage());
    if (report.step == 0) before = lost;
    length = 0.028 * lost / before - 0.01;
    const Energies& e = problem.state().energies;
    if (report.step == 1) {
      const FieldView u = problem.state().displacement();
      const double opening = u.component(1)[problem.body().set("upper_lip").front()] - u.component(1)[problem.body().set("lower_lip").front()];
      stiffness = of_set("upper_pin", reactions(problem, false, report.time)) / opening;
    }
    if (first_length == 0 && length > 1.1 * 0.018) {
      first_length = length;
      first_dissipated = e.dissipated;
    }
  };
  specimen->run(watch);
  // Saxena and Hudak, International Journal of Fracture 14 (1978) 453: a/W = 0.45.
  constexpr double a = 0.45;
  constexpr double compliance = (1 + a) / (1 - a) * (1 + a) / (1 - a) *
                                (2.1630 + a * (12.219 + a * (-20.065 + a * (-0.9925 + a * (20.609 - 9.9314 * a)))));
  CHECK(stiffness == doctest::Approx(3e9 / compliance).epsilon(0.05));
  CHECK(length > 0.03);
  CHECK((problem.state().energies.dissipated - first_dissipated) / (500 * (length - first_length)) == doctest::Approx(1).epsilon(0.1));
}

TEST_CASE("crack in a strip: what bonds set free follows from the forces that are there, as if all of it were evaluated anew") {
  const auto scene = [](const char* skip) {
    return load("fracture/strip.toml", {"kinematics=baqp", "integrator.end_time=2e-5", fmt::format("run.skip={}", skip)});
  };
  const auto found = scene("true"), anew = scene("false");
  const RunEnergies some = run(*found), every = run(*anew);
  CHECK(some.dissipated > 0);
  CHECK(some.dissipated == doctest::Approx(every.dissipated).epsilon(1e-9));
  CHECK(found->problem().fracture()->checks().failed == anew->problem().fracture()->checks().failed);
}

TEST_CASE("mode I: a straight crack to the right edge, and nothing else") {
  struct Run {
    const char *kinematics, *influence, *consistent;
    double lip;   ///< less than the damage of a point beside a crack: far bonds count for less in the cubic kernel
  };
  for (const auto& [kinematics, influence, consistent, lip] :
       {Run{"bond_based", "constant", "false", 0.35}, Run{"ordinary", "constant", "false", 0.35}, Run{"baqp", "cubic_spline", "true", 0.3}}) {
    INFO(kinematics);
    // Ten times faster than in the paper, so that the run is short.
    const auto simulation = load("partmann/mode_I.toml", {fmt::format("kinematics={}", kinematics), fmt::format("family.influence={}", influence),
                                                          fmt::format("damage.consistent={}", consistent), "body.lattice.spacing=4e-5", "constants.dx=4e-5", "integrator.end_time=1.6e-5",
                                                          "boundary=[{set=\"top\", velocity=[\"free\", 0.5, \"free\"]}, {set=\"bottom\", velocity=[\"free\", -0.5, \"free\"]}]"});
    BodyProblem& problem = simulation->problem();
    const double before = most_damage(problem, [](const Point& x) { return x[0] > 0.2e-3; });
    const RunEnergies balance = run(*simulation);
    CHECK(before == 0);
    CHECK(most_damage(problem, [](const Point& x) { return x[0] > 0.46e-3; }) > lip);
    CHECK(most_damage(problem, [](const Point& x) { return std::abs(x[1]) > 0.25e-3; }) < 0.1);
    CHECK(balance.dissipated > 0);
    CHECK_MESSAGE(std::abs(balance.missing) <= 0.03 * balance.dissipated, balance.missing, " J missing, ", balance.dissipated, " J dissipated");
  }
}

TEST_CASE("boundary tension: the energy balance holds to the end, whatever the number of threads and the checks that are skipped") {
  const auto scene = [](std::vector<std::string> more) {
    more.insert(more.end(), {"body.lattice.spacing=1e-3", "constants.dx=1e-3", "integrator.end_time=4e-5"});
    return load("partmann/boundary_tension.toml", std::move(more));
  };
  const auto simulation = scene({});
  const RunEnergies balance = run(*simulation);
  CHECK(balance.dissipated > 0);
  CHECK_MESSAGE(std::abs(balance.missing) <= 0.01 * balance.work, balance.missing, " J missing, work ", balance.work, " J");
  CHECK(most_damage(simulation->problem(), [](const Point& x) { return x[0] > 0.08; }) > 0.35);
  // The same bonds fail at the same steps when every bond is looked at in every step.
  const auto all = scene({"run.skip=false"});
  run(*all);
  const BondChecks some = simulation->problem().fracture()->checks(), every = all->problem().fracture()->checks();
  CHECK(every.checked == every.groups);
  CHECK(some.checked < some.groups);
  CHECK(some.failed == every.failed);
}

TEST_CASE("boundary tension: on clouds the forces of pair laws say which bonds are near failure, and no other is looked at") {
  for (const std::string kinematics : {"bond_based", "ordinary"}) {
    const auto scene = [&](const std::string& skip) {
      return load("partmann/boundary_tension.toml", {"kinematics=" + kinematics, "body.lattice.spacing=1e-3", "body.lattice.jitter=0.1", "constants.dx=1e-3",
                                                     "family.influence=cubic_spline", "damage.consistent=true", "integrator.end_time=2e-5", "run.skip=" + skip});
    };
    const auto skipping = scene("true"), all = scene("false");
    run(*skipping);
    run(*all);
    const BondChecks some = skipping->problem().fracture()->checks(), every = all->problem().fracture()->checks();
    INFO(kinematics);
    CHECK(every.checked == every.groups);
    CHECK(5 * some.checked < some.groups);   // 95 of 100 by margins alone
    CHECK(some.failed > 0);
    CHECK(some.failed == every.failed);
    const FieldView u = skipping->problem().state().displacement(), v = all->problem().state().displacement();
    CHECK(std::equal(u.data, u.data + u.size(), v.data));
  }
}

TEST_CASE("boundary tension: baqp with the cubic kernel runs to the end, and no update of bonds raises the energy by more than traces") {
  // On 100 x 40 x 4 points. Without fragments the same run raises it by 14 times what it dissipates.
  const auto simulation = load("partmann/boundary_tension.toml", {"kinematics=baqp", "family.influence=cubic_spline", "damage.consistent=true", "body.lattice.spacing=1e-3",
                                                                  "constants.dx=1e-3", "integrator.end_time=6e-5"});
  BodyProblem& problem = simulation->problem();
  double tip = 0.05, start = 0, off = 0;
  contract::Watch watch(*simulation);
  watch.each = [&](const StepReport& report) {
    const Energies& e = problem.state().energies;
    if (report.time > 1e-5) off = std::max(off, std::abs(e.external_work - e.strain - e.kinetic - e.dissipated) / e.external_work);
    if (report.step % 10 != 0) return;
    const Field damage = problem.terms().damage();
    double now = 0.05;
    for (const std::int32_t p : problem.body().internal())
      if (damage.data()[p] > 0.35) now = std::max(now, problem.body().position(static_cast<std::size_t>(p))[0]);
    if (tip < 0.06 && now >= 0.06) start = report.time;
    if (tip < 0.09 && now >= 0.09) {
      // Rayleigh waves: c_s (0.862 + 1.14 nu)/(1 + nu), 2129 m/s.
      const double speed = 0.03 / (report.time - start);
      CHECK_MESSAGE((speed > 500 && speed < 2129), "the crack runs at ", speed, " m/s");
    }
    tip = now;
  };
  simulation->run(watch);
  CHECK(tip > 0.09);
  CHECK_MESSAGE(off <= 0.005, "balance off by ", off, " of the work");
  // 2e-4 of it, or nothing, with the length of the step.
  const double raised = raised_by_updates(watch), dissipated = watch.energies.back().dissipated;
  CHECK_MESSAGE(raised <= 1e-3 * dissipated, raised, " J raised, ", dissipated, " J dissipated");
  // One crack at x = 0.09 in the lowest layer: at this spacing it branches under 1.5 MPa, not under 1 MPa, as with half of the step.
  // Displacements stay far below the plate's size.
  const Field damage = problem.terms().damage();
  int arms = 0;
  bool inside = false;
  double most = 0;
  for (const std::int32_t p : problem.body().internal()) {
    const Point x = problem.body().position(static_cast<std::size_t>(p));
    for (int c = 0; c < 3; ++c) most = std::max(most, std::abs(problem.state().displacement().component(c)[p]));
    if (std::abs(x[0] - 0.0895) > 1e-5 || x[2] > -1e-3) continue;
    const bool broken = damage.data()[p] > 0.25;
    if (broken && !inside) ++arms;
    inside = broken;
  }
  CHECK(arms == 1);
  CHECK(most < 1e-3);
}

TEST_CASE("bonds whose failure would raise the energy stay: none is created from nowhere") {
  const auto run_with = [](const char* second_law) {
    return load(
        "fracture/branching.toml",
        {"kinematics=sub_horizon", "constants.sigma=1e6", "integrator.end_time=4e-5", "run.threads=1",
         fmt::format(
             "damage={{type=\"critical_stretch\",energy_release_rate=0.75,consistent=true,no_fail=[\"top\",\"bottom\"]{}}}",
             second_law)});
  };
  const auto raised = [](const contract::Watch& watch) {
    double sum = 0;
    for (std::size_t k = 1; k < watch.energies.size(); ++k)
      sum += std::max(0.0, watch.energies[k - 1].dissipated - watch.energies[k].dissipated);
    return sum;
  };
  const auto without = run_with(",second_law=false"), with = run_with("");
  const contract::Watch any = contract::run(*without), lawful = contract::run(*with);
  // Half of what the other updates take.
  CHECK(raised(any) > 0.3 * any.energies.back().dissipated);
  CHECK(raised(lawful) == 0);
  CHECK(with->problem().fracture_summary().find("bonds held") != std::string::npos);
  const Energies& e = lawful.energies.back();
  CHECK(std::abs(e.external_work - e.strain - e.kinetic - e.dissipated) <= 0.001 * e.external_work);
  // The crack has run on.
  CHECK(most_damage(with->problem(), [](const Point& x) { return x[0] > 0.06 && std::abs(x[1]) < 0.012; }) > 0.35);
}

TEST_CASE("a block that bursts: fragments fly on, momentum stays") {
  struct Block {
    std::string kinematics;
    bool cloud = false;
  };
  for (const auto& [kinematics, cloud] : {Block{"bond_based"}, Block{"ordinary"}, Block{"conventional"}, Block{"baqp"}, Block{"projection"},
                                          Block{"{type=\"selective\",base={type=\"baqp\"}}"}, Block{"conventional", true}, Block{"baqp", true},
                                          Block{"{type=\"conventional\",stabilization={type=\"silling\",coefficient=0.5}}", true}}) {
    INFO(kinematics, std::string(cloud ? ", cloud" : ", lattice"));
    // Every length grows by 2 % a microsecond, on top of a flight to the right.
    const auto simulation = load("partmann/boundary_tension.toml", {fmt::format("kinematics={}", kinematics), "family.influence=cubic_spline", fmt::format("body.lattice.jitter={}", cloud ? 0.1 : 0.0), "body.lattice.spacing=2e-3", "constants.dx=2e-3",
                                                                    "integrator.end_time=4e-6", "damage.no_fail=[]", "load=[]",
                                                                    "initial={velocity=[\"300 + 2e4*(x - 0.05)\", \"2e4*y\", \"2e4*z\"]}"});
    BodyProblem& problem = simulation->problem();
    const Body& body = problem.body();
    const auto momentum = [&](int c) {
      double sum = 0;
      for (const std::int32_t p : body.internal()) sum += problem.masses().by_point()[static_cast<std::size_t>(p)] * problem.state().velocity().component(c)[p];
      return sum;
    };
    const double scale = 300 * 2440 * 0.1 * 0.04 * 0.004;
    const std::array<double, 3> before = cloud ? std::array{momentum(0), momentum(1), momentum(2)} : std::array{scale, 0.0, 0.0};
    const RunEnergies balance = run(*simulation);
    for (int c = 0; c < 3; ++c) CHECK(std::abs(momentum(c) - before[static_cast<std::size_t>(c)]) <= 1e-10 * scale);
    const Field damage = problem.terms().damage();
    std::size_t fragments = 0;
    for (const std::int32_t p : body.internal()) {
      fragments += damage.data()[p] == 1;
      for (int c = 0; c < 3; ++c) CHECK(std::isfinite(problem.state().displacement().component(c)[p]));
    }
    CHECK(fragments > body.points() / 2);
    CHECK(balance.dissipated > 0);
  }
}

TEST_CASE("rubber sheet: the crack of a stretched, nearly incompressible sheet runs on along its middle") {
  const auto simulation = load("fracture/rubber_sheet.toml", {"integrator.end_time=1.6e-3", "damage.gradual=false", "run.threads=1"});
  BodyProblem& problem = simulation->problem();
  const contract::Watch watch = contract::run(*simulation);
  const Energies first = watch.energies.front(), last = watch.energies.back();
  const double before = first.strain + first.kinetic;
  CHECK(last.dissipated > 0);
  CHECK_MESSAGE(std::abs(before + last.external_work - last.strain - last.kinetic - last.dissipated) <= 0.02 * before, "of ", before, " J: ",
                last.strain + last.kinetic + last.dissipated - last.external_work, " J at the end");
  CHECK(most_damage(problem, [](const Point& x) { return x[0] > 0.025; }) > 0.25);
  CHECK(most_damage(problem, [](const Point& x) { return std::abs(x[1]) > 0.01; }) < 0.1);
}

TEST_CASE("rubber sheet with selective: half way through, torn families have created next to nothing") {
  // On 60 x 40 points. With the whole volume of torn families updates would raise the energy by a third of what is dissipated.
  // 2 % are given back, and 6 to 6.6 % where one late update does: in 7 of 28 runs with steps from 0.495 to 0.503 of the stable one.
  std::vector<double> shares;
  for (const char* const safety : {"0.498", "0.5", "0.501"}) {
    const auto sheet = load("fracture/rubber_sheet.toml", {"kinematics={type=\"selective\",base={type=\"baqp\"}}", "body.lattice.spacing=1e-3",
                                                           "integrator.end_time=1.5e-3", fmt::format("integrator.safety={}", safety)});
    const contract::Watch watch = contract::run(*sheet);
    check_dissipation(watch, 0.05, 0.08);
    shares.push_back(raised_by_updates(watch) / watch.energies.back().dissipated);
  }
  std::ranges::sort(shares);
  CHECK(shares[1] <= 0.06);
}

TEST_CASE("rubber sheet with selective: bonds that let go gradually dissipate, and a resumed run is bitwise the run without a stop") {
  // On 30 x 20 points. Bonds that fail at once raise the energy here by more than what is dissipated, and the run stops.
  const auto sheet = [] {
    return load("fracture/rubber_sheet.toml", {"kinematics={type=\"selective\",base={type=\"baqp\"}}", "body.lattice.spacing=2e-3", "damage.stretch=0.7",
                                               "integrator.end_time=6e-4", "run.threads=1"});
  };
  const auto whole = sheet(), first = sheet(), second = sheet();
  const contract::Watch watch = contract::run(*whole);
  check_dissipation(watch, 0.005, 0.05);
  CHECK(most_damage(whole->problem(), [](const Point& x) { return x[0] > 0.0165; }) > 0.25);
  CHECK(most_damage(whole->problem(), [](const Point& x) { return std::abs(x[1]) > 0.01; }) < 0.1);
  contract::run(*first, 3 * watch.reports.back().step / 4);
  const BondChecks checks = first->problem().fracture()->checks();
  CHECK(checks.failed > 0);
  CHECK(checks.weakened > 0);
  second->problem().restore(first->problem().snapshot());
  contract::run(*second);
  CHECK(contract::state(*second) == contract::state(*whole));
}
