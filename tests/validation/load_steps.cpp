/// Load stepping: cut-back, limit points, scales, and options that must change something. On small bodies, with every integrator.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>

#include "tests/kit/messages.hpp"
#include "tests/validation/quasi_static.hpp"

using namespace perikit;
using namespace perikit::validation;
using contract::BodyOptions;

namespace {

const std::vector<std::string> integrators{"newton", "jfnk", "kinsol", "dynamic_relaxation"};
const std::string kinematics = "type = \"baqp\"";

BodyOptions plate(const std::string& integrator, const std::string& more) {
  BodyOptions body;
  body.dimension = 2;
  body.cells = 10;
  body.material = "type = \"neo_hookean\"\nshear_modulus = 1.0\nbulk_modulus = 2.0";
  body.sets = "left = \"x < 2\"\nright = \"x > 6\"\n";
  body.conditions = "[[boundary]]\nset = \"left\"\ndisplacement = [0, 0]\n";
  body.integrator = "type = \"" + integrator + "\"\n" + more;
  return body;
}

std::unique_ptr<Simulation> pulled(const std::string& integrator, const std::string& more, const std::string& motion = "[0.3, 0.1]") {
  BodyOptions body = plate(integrator, more);
  body.conditions += "[[boundary]]\nset = \"right\"\ndisplacement = " + motion + "\n";
  return build(contract::scene_text(body, kinematics));
}

}  // namespace

TEST_CASE("a step that is too long is cut back, grows again and still meets the planned points") {
  for (const std::string& integrator : integrators) {
    INFO(integrator);
    // Too far for so few iterations in one step.
    const std::string few = integrator == "dynamic_relaxation" ? "max_iterations = 60\n" : integrator == "kinsol" ? "max_iterations = 4\n" : "max_iterations = 3\n";
    const auto simulation = pulled(integrator, "steps = 2\ntolerance = 1e-8\n" + few, "[-2.6, 1.5]");
    const Protocol protocol = run(*simulation);
    CHECK(protocol.reports.size() > 3);
    bool half = false;
    double shortest = 1, longest = 0;
    for (const StepReport& report : protocol.reports) {
      half = half || report.time == 0.5;
      if (report.step == 0) continue;
      shortest = std::min(shortest, report.time_step);
      longest = std::max(longest, report.time_step);
    }
    CHECK(half);
    CHECK(protocol.reports.back().time == 1.0);
    CHECK(longest >= 2 * shortest);
    CHECK(protocol.reports.back().time_step <= 0.5);
    CHECK(protocol.text.find("no equilibrium at t = ") != std::string::npos);
  }
}

TEST_CASE("past a limit point the run ends with load parameter, step and reason") {
  for (const std::string& integrator : integrators) {
    INFO(integrator);
    // Hencky's nominal stress E ln(s)/s has its maximum E/e at s = e: the load reaches it at t = 0.5.
    BodyOptions body = plate(integrator, "steps = 4\ntolerance = 1e-6\nmax_iterations = " + std::string(integrator == "dynamic_relaxation" ? "2000" : "12") + "\ncut_backs = 2\n");
    body.dimension = 1;
    body.cells = 12;
    body.plane = "stress";
    body.material = "type = \"hencky\"\nyoungs_modulus = 2.0\npoisson_ratio = 0.0";
    body.sets = "left = \"x < 3\"\nright = \"x > 11\"\n";
    body.conditions = fmt::format("[[boundary]]\nset = \"left\"\ndisplacement = [0]\n[[load]]\nset = \"right\"\nforce = [{}]\n", 2 * 2.0 * 1.5 / std::exp(1.0));
    const auto simulation = build(contract::scene_text(body, "type = \"projection\""));
    Protocol protocol;
    const std::string message = test::message_of<RunError>([&] { simulation->run(protocol); });
    CAPTURE(message);
    CHECK(message.starts_with(integrator + ": no equilibrium found beyond load parameter 0."));
    for (const char* part : {"the smallest step, 0.0625, failed because ", "limit point"}) CHECK(message.find(part) != std::string::npos);
    CHECK(protocol.reports.back().time >= 0.25);
    CHECK(protocol.reports.back().time <= 0.55);
  }
}

TEST_CASE("convergence is relative: units do not matter, and a rigid motion converges") {
  for (const std::string& integrator : integrators) {
    INFO(integrator);
    BodyOptions metres = plate(integrator, "steps = 3\ntolerance = 1e-9\n"), small = metres;
    metres.conditions += "[[boundary]]\nset = \"right\"\ndisplacement = [0.3, 0.1]\n";
    small.scale = 1e-3;
    small.material = "type = \"neo_hookean\"\nshear_modulus = 1.0e9\nbulk_modulus = 2.0e9";
    small.sets = "left = \"x < 0.002\"\nright = \"x > 0.006\"\n";
    small.conditions += "[[boundary]]\nset = \"right\"\ndisplacement = [0.3e-3, 0.1e-3]\n";
    const auto a = build(contract::scene_text(metres, kinematics)), b = build(contract::scene_text(small, kinematics));
    const Protocol of_a = run(*a), of_b = run(*b);
    double most = 0;
    for (const std::int32_t p : a->problem().body().internal())
      for (int c = 0; c < 2; ++c) most = std::max(most, std::abs(a->problem().state().displacement().component(c)[p] - 1e3 * b->problem().state().displacement().component(c)[p]));
    CHECK_MESSAGE(most <= 1e-8, "other units move a point by ", most);
    CHECK(std::abs(of_a.iterations() - of_b.iterations()) <= of_a.iterations() / 10);

    BodyOptions rigid = plate(integrator, "steps = 2\ntolerance = 1e-9\n");
    rigid.conditions = "[[boundary]]\nset = \"left\"\ndisplacement = [4, -3]\n";
    const auto moved = build(contract::scene_text(rigid, kinematics));
    run(*moved);
    CHECK(std::abs(mean(*moved, "right", 0) - 4) <= 1e-6);
    CHECK(std::abs(mean(*moved, "right", 1) + 3) <= 1e-6);
  }
}

TEST_CASE("options of quasi-static integrators change the way and not the answer") {
  struct Variant {
    std::string integrator, plain, other;
    bool linear_iterations;   ///< compare the log, not the number of iterations
  };
  const std::vector<Variant> variants{
      {"jfnk", "", "tangent = \"differences\"\n", true},
      {"jfnk", "", "preconditioner = \"none\"\n", true},
      {"jfnk", "preconditioner = \"none\"\n", "preconditioner = \"jacobi\"\n", true},
      {"jfnk", "preconditioner = \"none\"\n", "preconditioner = \"none\"\nrestart = 5\n", true},
      {"kinsol", "", "strategy = \"picard\"\n", false},
      {"kinsol", "", "strategy = \"fixed_point\"\nmax_iterations = 5000\n", false},
      {"kinsol", "strategy = \"fixed_point\"\nmax_iterations = 5000\n", "strategy = \"fixed_point\"\nmax_iterations = 5000\nanderson = 3\n", false},
      {"kinsol", "preconditioner = \"none\"\n", "preconditioner = \"none\"\nlinear_solver = \"spbcgs\"\n", true},
      {"kinsol", "preconditioner = \"none\"\n", "preconditioner = \"none\"\nlinear_solver = \"sptfqmr\"\n", true},
      {"kinsol", "preconditioner = \"none\"\n", "preconditioner = \"none\"\nrestart = 4\n", true},
      {"kinsol", "preconditioner = \"none\"\n", "preconditioner = \"jacobi\"\n", true},
      {"dynamic_relaxation", "", "damping = \"kinetic\"\n", false},
  };
  const auto reference = pulled("newton", "steps = 2\ntolerance = 1e-11\n", "[1.2, 0.9]");
  run(*reference);
  for (const Variant& variant : variants) {
    INFO(variant.integrator, ": ", variant.plain, " against ", variant.other);
    const std::string common = "steps = 2\ntolerance = 1e-9\n";
    const auto a = pulled(variant.integrator, common + variant.plain, "[1.2, 0.9]"), b = pulled(variant.integrator, common + variant.other, "[1.2, 0.9]");
    const Protocol of_a = run(*a), of_b = run(*b);
    CHECK(distance(*a, *reference) <= 1e-6);
    CHECK(distance(*b, *reference) <= 1e-6);
    if (variant.linear_iterations) CHECK(of_a.text != of_b.text);
    else CHECK(of_a.iterations() != of_b.iterations());
  }
}

TEST_CASE("kinsol's line search shortens steps of a slender body, and its answer is that of full steps") {
  const std::vector<std::string> common{"kinematics=baqp", "integrator.type=\"kinsol\"", "integrator.linear_solver=\"klu\"", "integrator.steps=20"};
  std::vector<std::string> full = common, searched = common;
  full.push_back("integrator.strategy=\"none\"");
  searched.push_back("integrator.strategy=\"linesearch\"");
  const auto a = load("hashim/cantilever.toml", full), b = load("hashim/cantilever.toml", searched);
  const Protocol of_a = run(*a), of_b = run(*b);
  CHECK(of_a.text != of_b.text);
  CHECK(distance(*a, *b) <= 1e-8);
}

TEST_CASE("a body that nothing moves stays where it is, with a residual of zero") {
  for (const std::string& integrator : integrators) {
    INFO(integrator);
    const auto simulation = build(contract::scene_text(plate(integrator, "steps = 2\n"), kinematics));
    const Protocol protocol = run(*simulation);
    CHECK(protocol.reports.size() == 3);
    for (const StepReport& report : protocol.reports) CHECK(report.residual == 0);
    for (const std::int32_t p : simulation->problem().body().internal())
      for (int c = 0; c < 2; ++c) CHECK(simulation->problem().state().displacement().component(c)[p] == 0);
  }
}

TEST_CASE("an equilibrium that is not stable is told, by every integrator and once; one that is stable is not") {
  // A column that is shortened, clamped and guided; a small force chooses its side. With few steps the path stays straight beyond Euler's load.
  const auto column = [](const std::string& integrator, double shortened, double aside) {
    return build(fmt::format(
        "format = 1\n[body]\ndimension = 2\nplane = \"stress\"\n[body.lattice]\nspacing = 0.25\nlower = [0, -0.5]\nupper = [10, 0.5]\n[sets]\ntip = {{ nearest = [10, 0] }}\n"
        "[family]\nhorizon_ratio = 2.515\ninfluence = \"gaussian\"\n[kinematics]\ntype = \"baqp\"\n[material]\ntype = \"saint_venant_kirchhoff\"\nyoungs_modulus = 1200.0\n"
        "poisson_ratio = 0.0\n[[boundary]]\nface = \"-x\"\ndisplacement = [0, 0]\n[[boundary]]\nface = \"+x\"\ndisplacement = [\"-{}*t\", \"free\"]\n[[load]]\nset = \"tip\"\n"
        "force = [\"0\", \"{}\"]\nramp = false\n[integrator]\nsteps = 4\n{}",
        shortened, aside, integrator));
  };
  const std::string told = "is not stable";
  for (const std::string integrator :
       {"type = \"newton\"\n", "type = \"newton\"\nlinear_solver = \"krylov\"\n", "type = \"jfnk\"\n", "type = \"jfnk\"\npreconditioner = \"companion\"\n",
        "type = \"jfnk\"\npreconditioner = \"none\"\n", "type = \"kinsol\"\n", "type = \"kinsol\"\nlinear_solver = \"klu\"\n", "type = \"dynamic_relaxation\"\n"}) {
    INFO(integrator);
    const auto straight = column(integrator, 0.3, 0.0), held = column(integrator, 0.03, 0.0);
    const Protocol beyond = run(*straight), before = run(*held);
    const std::size_t at = beyond.text.find(told);
    REQUIRE_MESSAGE(at != std::string::npos, beyond.text);
    CHECK(beyond.text.find(told, at + 1) == std::string::npos);
    CHECK_MESSAGE(before.text.find(told) == std::string::npos, before.text);
  }
  const auto bent = column("type = \"newton\"\n", 0.3, 0.3);
  const Protocol stable = run(*bent);
  CHECK(std::abs(mean(*bent, "tip", 1)) > 1);
  CHECK_MESSAGE(stable.text.find(told) == std::string::npos, stable.text);
}

TEST_CASE("an equilibrium of a nearly incompressible body that is not stable is told by mixed systems; one that is stable is not") {
  const auto column = [](double shortened) {
    return build(fmt::format(
        "format = 1\n[body]\ndimension = 2\nplane = \"strain\"\n[body.lattice]\nspacing = 0.25\nlower = [0, -0.5]\nupper = [10, 0.5]\n[family]\nhorizon_ratio = 2.015\n"
        "[kinematics]\ntype = \"selective\"\nbase = \"baqp\"\n[material]\ntype = \"neo_hookean\"\nshear_modulus = 1.0\nbulk_modulus = 1000.0\n"
        "[[boundary]]\nface = \"-x\"\ndisplacement = [0, 0]\n[[boundary]]\nface = \"+x\"\ndisplacement = [-{}, \"free\"]\n"
        "[integrator]\ntype = \"jfnk\"\npreconditioner = \"mixed\"\nsteps = 2\n",
        shortened));
  };
  const std::string told = "is not stable";
  CHECK(run(*column(1.0)).text.find(told) != std::string::npos);
  CHECK(run(*column(0.03)).text.find(told) == std::string::npos);
}

TEST_CASE("forces of any size: what a load does is in proportion to it, from numbers without digits to those whose squares are none") {
  const auto pulled = [](const std::string& integrator, double force) {
    return build(fmt::format(
        "format = 1\n[body]\ndimension = 2\nplane = \"strain\"\n[body.lattice]\nspacing = 0.1\nlower = [0, 0]\nupper = [1, 0.4]\n[sets]\nlow = \"x < 0.1\"\nhigh = \"x > 0.9\"\n"
        "[family]\nhorizon_ratio = 2.015\n[kinematics]\ntype = \"baqp\"\n[material]\ntype = \"linear_elastic\"\nyoungs_modulus = 1e6\npoisson_ratio = 0.25\n[[boundary]]\n"
        "set = \"low\"\ndisplacement = [0, 0]\n[[load]]\nset = \"high\"\nforce = [{:.17g}, 0]\n[integrator]\nsteps = 1\n{}",
        force, integrator));
  };
  for (const std::string integrator : {"type = \"newton\"\n", "type = \"newton\"\nlinear_solver = \"krylov\"\n", "type = \"jfnk\"\n", "type = \"kinsol\"\n", "type = \"dynamic_relaxation\"\n"}) {
    const auto one = pulled(integrator, 1.0);
    run(*one);
    const double u = mean(*one, "high", 0);
    CHECK(u > 0);
    for (const double force : {1e-290, 1e-200, 1e-160, 1e100, 1e150}) {
      INFO(integrator, force);
      const auto other = pulled(integrator, force);
      run(*other);
      CHECK(mean(*other, "high", 0) / force == doctest::Approx(u).epsilon(1e-6));
    }
  }
}
