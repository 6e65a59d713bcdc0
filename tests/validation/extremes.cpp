/// The ends of what a scene may ask for: nearly incompressible rubber, large stretch, shear and rotation, other systems of units,
/// bodies of a few points, points that are alone.

#include <doctest/doctest.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <fstream>
#include <numbers>

#include "tests/kit/messages.hpp"
#include "tests/kit/scene_text.hpp"
#include "tests/kit/vector_text.hpp"
#include "tests/validation/quasi_static.hpp"
#include "unit/temporary_folder.hpp"

using namespace perikit;
using namespace perikit::validation;

namespace {

/// Kinematics with its first example as lines of [kinematics].
std::string table_of(const std::string& kinematics) {
  return fmt::format("type = \"{}\"\n{}", kinematics, registry().describe(Kind::kinematics, kinematics).examples.front());
}

/// Every kinematics, conventional with every stabilization too.
std::vector<std::string> kinematics_tables() {
  std::vector<std::string> all;
  for (const std::string& name : registry().names(Kind::kinematics)) all.push_back(table_of(name));
  for (const std::string& name : registry().names(Kind::stabilization))
    all.push_back(fmt::format("type = \"conventional\"\nstabilization = \"{}\"", name));
  return all;
}

/// A block of 8 x 4 points in plane strain whose ends are moved as `right` says, the left one held.
std::string block(const std::string& kinematics, const std::string& material, const std::string& left, const std::string& right,
                  int steps) {
  return fmt::format(
      "format = 1\n[body]\ndimension = 2\nplane = \"strain\"\n[body.lattice]\nspacing = 1.0\nlower = [0, 0]\nupper = [8, 4]\n"
      "[sets]\nleft = \"x < 1\"\nright = \"x > 7\"\nfoot = {{ nearest = [0, 0] }}\n[family]\nhorizon_ratio = 2.015\ninfluence = "
      "\"gaussian\"\n"
      "[kinematics]\n{}\n[material]\n{}\n[[boundary]]\nset = \"left\"\ndisplacement = {}\n[[boundary]]\nset = "
      "\"right\"\ndisplacement = {}\n"
      "[integrator]\ntype = \"newton\"\nsteps = {}\n",
      kinematics, material, left, right, steps);
}

std::string rubber(double bulk) {
  return fmt::format("type = \"neo_hookean\"\nshear_modulus = 1.0\nbulk_modulus = {:.17g}", bulk);
}

/// Largest |J - 1| of the point gradients, the volume changes that `selective` sees.
double volume_change(Simulation& simulation) {
  const auto points = build(block("type = \"conventional\"", rubber(1.0), "[0, 0]", "[0, 0]", 1));
  PointSamples samples;
  REQUIRE(points->problem().terms().sample({simulation.problem().state().displacement(), 0}, samples).ok());
  double most = 0;
  for (const std::int32_t p : points->problem().body().internal()) {
    const auto H = [&](int c) { return samples.H.component(c)[p]; };
    most = std::max(most, std::abs((1 + H(0)) * (1 + H(3)) - H(1) * H(2) - 1));
  }
  return most;
}

}  // namespace

TEST_CASE("extremes: bulk over shear modulus from 1 to 1e6: converged, and selective stays soft") {
  // Tension with free sides: at the incompressible limit the pull does not depend on the bulk modulus any more.
  for (const std::string kinematics :
       {"type = \"selective\"\nbase = \"bond_associated\"", "type = \"selective\"\nbase = \"baqp\"", "type = \"baqp\""}) {
    INFO(kinematics);
    const bool selective = kinematics.find("selective") != std::string::npos;
    std::vector<double> pulls;
    for (const double ratio : {1.0, 1e2, 1e4, 1e6}) {
      INFO("kappa/mu ", ratio);
      const auto simulation = build(block(kinematics, rubber(ratio), "[0, \"free\"]", "[2, \"free\"]", 4) +
                                    "[[boundary]]\nset = \"foot\"\ndisplacement = [0, 0]\n");
      const Protocol protocol = run(*simulation);
      CHECK(protocol.reports.back().time == 1.0);
      pulls.push_back(pull(*simulation, "right", 0));
      if (selective && ratio >= 100) CHECK(volume_change(*simulation) <= 10 / ratio);
    }
    MESSAGE(fmt::format("pull: {:.5f}", fmt::join(pulls, ", ")));
    // A homogeneous state: 4 mu (l - l^-3), where the stretch l is that of points 7 spacings apart.
    const double l = 9.0 / 7;
    CHECK(pulls[3] == doctest::Approx(4 * (l - 1 / (l * l * l))).epsilon(0.2));
    CHECK(std::abs(pulls[3] / pulls[2] - 1) <= 1e-3);
    CHECK(pulls[3] / pulls[1] <= 1.05);
  }
}

TEST_CASE("extremes: a block stretched to five times its length, sheared by three, and back to rest") {
  for (const std::string kinematics : {"type = \"baqp\"", "type = \"selective\"\nbase = \"bond_associated\"",
                                       "type = \"conventional\"\nstabilization = \"silling\""}) {
    for (const std::string& material :
         {rubber(5.0), std::string("type = \"mooney_rivlin\"\ndensity = 1.0\nC1 = 0.3\nC2 = 0.1\nbulk_modulus = 5.0"),
          std::string("type = \"hencky\"\nyoungs_modulus = 2.5\npoisson_ratio = 0.3")}) {
      INFO(kinematics, " ", material);
      // Up and down again: t goes to 1/2 and back.
      const std::string there = "4 * t * (1 - t)";
      for (const auto& [right, reach] :
           {std::pair{fmt::format("[\"28 * {}\", 0]", there), 28.0}, {fmt::format("[0, \"21 * {}\"]", there), 21.0}}) {
        if (reach > 25 && material.find("hencky") != std::string::npos) continue;  // loses ellipticity far below
        INFO(right);
        const auto simulation = build(block(kinematics, material, "[0, 0]", right, 60));
        const Protocol protocol = run(*simulation);
        CHECK(protocol.reports.back().time == 1.0);
        double most = 0;
        for (const std::int32_t p : simulation->problem().body().internal())
          for (int c = 0; c < 2; ++c) most = std::max(most, std::abs(simulation->problem().state().displacement().component(c)[p]));
        CHECK(most <= 1e-6);
        CHECK(std::abs(simulation->problem().state().energies.strain) <= 1e-10);
      }
    }
  }
}

TEST_CASE("extremes: five turns leave a body as it was") {
  const double turns = 10 * std::numbers::pi;
  const auto turn = [&](double x0, double y0) {
    return fmt::format(
        "[\"(x - {0}) * cos({2:.17g} * t) - (y - {1}) * sin({2:.17g} * t) - (x - {0})\", \"(x - {0}) * sin({2:.17g} * t) + (y - "
        "{1}) * cos({2:.17g} * t) - (y - {1})\"]",
        x0, y0, turns);
  };
  for (const std::string& kinematics : kinematics_tables()) {
    if (kinematics.find("wan") != std::string::npos) continue;  // not objective, as its page says
    INFO(kinematics);
    const auto simulation = build(block(kinematics, rubber(5.0), turn(4, 2), turn(4, 2), 200));
    const Protocol protocol = run(*simulation);
    CHECK(protocol.reports.back().time == 1.0);
    double most = 0;
    for (const std::int32_t p : simulation->problem().body().internal())
      for (int c = 0; c < 2; ++c) most = std::max(most, std::abs(simulation->problem().state().displacement().component(c)[p]));
    CHECK(most <= 1e-7);
    CHECK(std::abs(simulation->problem().state().energies.strain) <= 1e-14);
  }
}

TEST_CASE("extremes: millimetres, newtons and tonnes give what metres, newtons and kilograms give, to 1e-10") {
  // Factors of length, mass and time; force = mass length / time^2.
  struct Units {
    double length, mass;
  };
  const auto scene = [](const Units& u, const std::string& kinematics, const std::string& integrator, bool damage) {
    const double stress = u.mass / u.length, density = u.mass / (u.length * u.length * u.length);
    std::string text = fmt::format(
        "format = 1\n[body]\ndimension = 2\nplane = \"strain\"\nthickness = {:.17g}\n[body.lattice]\nspacing = {:.17g}\nlower = "
        "[0, 0]\nupper = [{:.17g}, {:.17g}]\njitter = 0.1\n",
        0.01 * u.length, 0.01 * u.length, 0.08 * u.length, 0.04 * u.length);
    text += fmt::format(
        "[sets]\nleft = \"x < {:.17g}\"\nright = \"x > {:.17g}\"\n[family]\nhorizon_ratio = 2.015\ninfluence = "
        "\"gaussian\"\n[kinematics]\n{}\n",
        0.012 * u.length, 0.068 * u.length, kinematics);
    text += fmt::format(
        "[material]\ntype = \"saint_venant_kirchhoff\"\ndensity = {:.17g}\nyoungs_modulus = {:.17g}\npoisson_ratio = 0.25\n",
        7800 * density, 2e11 * stress);
    text += fmt::format(
        "[[boundary]]\nset = \"left\"\ndisplacement = [0, 0]\n[[load]]\nset = \"right\"\nbody_force = [{0:.17g}, "
        "{0:.17g}]\n[integrator]\n{1}\n",
        2e10 * stress / u.length, integrator);
    // A critical stretch from the energy release rate has a length in it.
    if (damage)
      text += fmt::format("[damage]\ntype = \"critical_stretch\"\nenergy_release_rate = {:.17g}\n", 1e5 * stress * u.length);
    return text;
  };
  double worst = 0;
  for (const std::string& kinematics : kinematics_tables()) {
    for (const std::string integrator : {"type = \"verlet\"\nend_time = 6.0e-5", "type = \"newton\"\nsteps = 2",
                                         "type = \"jfnk\"\nsteps = 1\ntolerance = 1e-12"}) {
      const bool verlet = integrator.find("verlet") != std::string::npos;
      for (const bool damage : {false, true}) {
        if (damage && (!verlet ||
                       (kinematics.find("baqp\"") == std::string::npos && kinematics.find("bond_based") == std::string::npos &&
                        kinematics.find("ordinary") == std::string::npos) ||
                       kinematics.find("selective") != std::string::npos))
          continue;
        INFO(kinematics, " ", integrator, " damage ", damage);
        const Units si{1, 1}, mm{1e3, 1e-3};
        const auto a = build(scene(si, kinematics, integrator, damage)), b = build(scene(mm, kinematics, integrator, damage));
        const Protocol first = run(*a), second = run(*b);
        CHECK(first.reports.size() == second.reports.size());
        double most = 0, difference = 0;
        for (const std::int32_t p : a->problem().body().internal())
          for (int c = 0; c < 2; ++c) {
            most = std::max(most, std::abs(a->problem().state().displacement().component(c)[p]));
            difference = std::max(difference, std::abs(b->problem().state().displacement().component(c)[p] / mm.length -
                                                       a->problem().state().displacement().component(c)[p]));
          }
        worst = std::max(worst, difference / most);
        CHECK(most > 0);
        CHECK_MESSAGE(difference <= 1e-10 * most, "relative difference ", difference / most);
        if (damage) {
          const auto broken = [](Simulation& s) { return s.problem().families().changed().size(); };
          CHECK(broken(*a) > 0);
          CHECK(broken(*a) == broken(*b));
        }
      }
    }
  }
  MESSAGE("largest difference ", worst);
}

TEST_CASE("extremes: bodies of one, two and three points in every space run or say why not") {
  int ran = 0, refused = 0;
  for (const std::string& kinematics : kinematics_tables())
    for (int d = 1; d <= 3; ++d)
      for (int n = 1; n <= 3; ++n)
        for (const std::string jitter : {"0.0", "0.2"})
          for (const std::string integrator : {"type = \"verlet\"\nend_time = 1.0", "type = \"newton\"\nsteps = 1",
                                               "type = \"dynamic_relaxation\"\nsteps = 1\nmax_iterations = 2000\ncut_backs = 1",
                                               "type = \"jfnk\"\nsteps = 1", "type = \"kinsol\"\nsteps = 1"}) {
            const std::string zero = test::vector_text(d, 0, 0, 0);
            std::vector<double> upper{1.0 * n, 1, 1};
            upper.resize(static_cast<std::size_t>(d));
            const std::string text = test::SceneText{
                .dimension = d, .upper = upper, .lattice = "jitter = " + jitter, .sets = fmt::format("first = {{ points = [0] }}\nlast = {{ points = [{}] }}", n - 1),
                .family = "horizon_ratio = 3.015", .kinematics = kinematics, .material = "type = \"neo_hookean\"\ndensity = 1.0\nshear_modulus = 1.0\nbulk_modulus = 2.0",
                .further = fmt::format("[[boundary]]\nset = \"first\"\ndisplacement = {}\n[[load]]\nset = \"last\"\nforce = {}\n{}", zero, test::vector_text(d, 0.1, 0, 0),
                                       integrator.starts_with("type = \"verlet") ? "" : "[run]\nweak_springs = 1e-6\n"),   // a held point does not hold against turns
                .integrator = integrator};
            INFO(text);
            try {
              const auto simulation = build(text);
              run(*simulation);
              ++ran;
              for (const std::int32_t p : simulation->problem().body().internal())
                for (int c = 0; c < d; ++c) CHECK(std::isfinite(simulation->problem().state().displacement().component(c)[p]));
              CHECK_NOTHROW(simulation->summary());
            } catch (const InputError& error) {
              ++refused;
              CHECK(std::string(error.what()).size() > 20);
            } catch (const RunError& error) {
              ++refused;
              CHECK(std::string(error.what()).size() > 20);
            }
          }
  MESSAGE(ran, " ran, ", refused, " ended with a message");
  CHECK(ran > refused / 2);
}

TEST_CASE("extremes: a point that is alone is a free mass in dynamics, and named or at rest in statics") {
  const TemporaryFolder folder;
  std::string cloud = "x,y,volume\n";
  for (int k = 0; k < 24; ++k) cloud += fmt::format("{},{},1\n", k % 6 + 0.5, k / 6 + 0.5);
  cloud += "100,100,1\n";
  std::ofstream(folder.path / "cloud.csv") << cloud;
  for (const std::string& kinematics : kinematics_tables()) {
    INFO(kinematics);
    const auto scene = [&](const std::string& integrator, const std::string& more) {
      return fmt::format(
          "format = 1\n[body]\ndimension = 2\nplane = \"strain\"\npoints = {{ file = \"cloud.csv\" }}\n[sets]\nleft = \"x < "
          "1\"\nalone = \"x > 50\"\n[family]\nhorizon = 2.1\n[kinematics]\n{}\n"
          "[material]\ntype = \"neo_hookean\"\ndensity = 1.0\nshear_modulus = 1.0\nbulk_modulus = 2.0\n[[boundary]]\nset = "
          "\"left\"\ndisplacement = [0, 0]\n{}[integrator]\n{}\n",
          kinematics, more, integrator);
    };
    const std::string file = (folder.path / "scene.toml").string();
    const auto dynamic =
        build(scene("type = \"verlet\"\nend_time = 2.0", "[initial]\nvelocity = [\"(x > 50) * 0.5\", 0]\n"), file);
    CHECK(dynamic->summary().find("warning") != std::string::npos);
    run(*dynamic);
    CHECK(mean(*dynamic, "alone", 0) == doctest::Approx(1.0).epsilon(1e-12));
    for (const std::string integrator : {"newton", "jfnk", "kinsol", "dynamic_relaxation"}) {
      INFO(integrator);
      const auto still = build(
          scene(fmt::format("type = \"{}\"\nsteps = 1", integrator), "[[boundary]]\nset = \"alone\"\ndisplacement = [0, 0]\n"),
          file);
      CHECK_NOTHROW(run(*still));
      // Nothing holds it: there is no equilibrium, or any.
      const std::string message =
          test::message_of<InputError>([&] { build(scene(fmt::format("type = \"{}\"\nsteps = 1", integrator), ""), file); });
      CHECK_MESSAGE(message.find("boundary: found nothing that holds a piece of 1 point about (100, 100, 0)") != std::string::npos, message);
    }
  }
}

namespace {

/// A block of 10 x 5 points whose ends are pulled by 1 %, `offset` away from the origin and `scale` times as large.
std::string far_block(double offset, double scale, double jitter) {
  const auto at = [&](double x) { return fmt::format("{:.17g}", offset + x * scale); };
  return fmt::format(
      "format = 1\n[body]\ndimension = 2\nplane = \"strain\"\nthickness = {0:.17g}\n[body.lattice]\nspacing = {1:.17g}\nlower = [{2}, 0]\nupper = "
      "[{3}, {4:.17g}]\njitter = {5}\n[sets]\nleft = \"x < {6}\"\nright = \"x > {7}\"\n[family]\nhorizon_ratio = 2.015\n[kinematics]\ntype = "
      "\"baqp\"\n[material]\ntype = \"saint_venant_kirchhoff\"\nyoungs_modulus = 1e6\npoisson_ratio = 0.3\n[[boundary]]\nset = "
      "\"left\"\ndisplacement = [0, 0]\n[[boundary]]\nset = \"right\"\ndisplacement = [{8:.17g}, 0]\n[integrator]\ntype = \"newton\"\nsteps = 1\n"
      "[run]\nthreads = 1\n",
      scale, 0.1 * scale, at(0), at(1), 0.5 * scale, jitter, at(0.12), at(0.88), 0.01 * scale);
}

/// Stored energy over that of a unit stress in its volume [-].
double far_energy(double offset, double scale, double jitter, std::string* summary = nullptr) {
  const auto simulation = build(far_block(offset, scale, jitter));
  if (summary) *summary = simulation->summary();
  run(*simulation);
  double energy = 0;
  Field force = simulation->problem().make_field();
  REQUIRE(simulation->problem().evaluate_forces({simulation->problem().state().displacement(), 0}, force, &energy).ok());
  return energy / (scale * scale * scale);
}

}  // namespace

TEST_CASE("extremes: bodies far from the origin, as small as atoms and as large as stars") {
  const double lattice = far_energy(0, 1, 0), cloud = far_energy(0, 1, 0.2);
  REQUIRE(lattice > 0);
  for (const double offset : {1e6, 1e9, 1e12}) CHECK(far_energy(offset, 1, 0) == doctest::Approx(lattice).epsilon(1e-12));
  for (const double scale : {1e-9, 1e-3, 1e9}) {
    CHECK(far_energy(0, scale, 0) == doctest::Approx(lattice).epsilon(1e-12));
    CHECK(far_energy(0, scale, 0.2) == doctest::Approx(cloud).epsilon(1e-9));
  }
  // Of points of a cloud rounding of their positions is a part of a bond.
  std::string near, far;
  CHECK(far_energy(1e3, 1, 0.2, &near) == doctest::Approx(cloud).epsilon(1e-10));
  far_energy(1e12, 1, 0.2, &far);
  CHECK(near.find("rounds to") == std::string::npos);
  CHECK_MESSAGE(far.find("rounds to") != std::string::npos, far);
}

TEST_CASE("extremes: a body whose bonds all fail within a step flies apart with the energy that it has") {
  for (const std::string kinematics : {"bond_based", "ordinary", "baqp", "bond_associated", "sub_horizon"})
    for (const std::string jitter : {"0.0", "0.2"}) {
      INFO(kinematics, ", jitter ", jitter);
      const auto simulation = build(fmt::format(
          "format = 1\n[body]\ndimension = 2\nplane = \"strain\"\n[body.lattice]\nspacing = 0.1\nlower = [0, 0]\nupper = [1, 0.5]\n"
          "jitter = {}\n[family]\nhorizon_ratio = 2.015\n[kinematics]\ntype = \"{}\"\n[material]\ntype = \"saint_venant_kirchhoff\"\n"
          "density = 1000.0\nyoungs_modulus = 1e6\npoisson_ratio = 0.25\n[damage]\ntype = \"critical_stretch\"\nstretch = 1e-6\n"
          "[initial]\nvelocity = [\"100*x\", \"100*y\"]\n[integrator]\ntype = \"verlet\"\nend_time = 0.002\n[run]\nthreads = 1\n",
          jitter, kinematics));
      run(*simulation);
      BodyProblem& problem = simulation->problem();
      const Energies& energies = problem.state().energies;
      CHECK(problem.families().changed().size() > 0);
      CHECK(energies.strain <= 1e-9 * energies.kinetic);
      double flight = 0;  // each point goes on as it began
      for (const std::int32_t p : problem.body().owned()) {
        const Point x = problem.body().position(static_cast<std::size_t>(p));
        for (int c = 0; c < 2; ++c)
          flight = std::max(flight, std::abs(problem.state().displacement().component(c)[p] - 0.2 * x[static_cast<std::size_t>(c)]));
      }
      CHECK_MESSAGE(flight < 1e-4, "off its way by ", flight, " m of 0.2");
    }
}
