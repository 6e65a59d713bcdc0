/// Mixed systems of displacements and pressures: nearly incompressible bodies at about the cost of compressible ones.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <sstream>

#include "perikit/core/parallel.hpp"
#include "tests/validation/quasi_static.hpp"

using namespace perikit;
using namespace perikit::validation;

namespace {

/// A rubber block of cells^d points on three held layers, pulled and sheared by its other end. more: further keys.
std::string scene(int dimension, int cells, double ratio, const std::string& integrator, const std::string& jitter = "0",
                  const std::string& more = "") {
  const bool solid = dimension == 3;
  return fmt::format(
      "format = 1\n[body]\ndimension = {0}\n{1}[body.lattice]\nspacing = {2:.17g}\nlower = [{3}{4:.17g}]\nupper = [{5}1]\njitter "
      "= {6}\n"
      "[sets]\nheld = \"{7} < 0\"\nend = \"{7} > 1 - {2:.17g}\"\n[family]\nhorizon_ratio = 2.015\ninfluence = \"cubic_spline\"\n"
      "[kinematics]\ntype = \"selective\"\nbase = \"baqp\"\n"
      "[material]\ntype = \"neo_hookean\"\nshear_modulus = 1.0\nbulk_modulus = {8}\n"
      "[[boundary]]\nset = \"held\"\ndisplacement = [{9}]\n[[load]]\nset = \"end\"\nforce = [{10}]\n{11}[integrator]\n{12}\n",
      dimension, solid ? "" : "plane = \"strain\"\n", 1.0 / cells, solid ? "0, 0, " : "0, ", -3.0 / cells,
      solid ? "1, 1, " : "1, ", jitter, solid ? "z" : "y", ratio, solid ? "0, 0, 0" : "0, 0",
      solid ? "0.05, 0, 0.1" : "0.05, 0.1", more, integrator);
}

std::string jfnk(const std::string& preconditioner, double tolerance = 1e-8) {
  return fmt::format("type = \"jfnk\"\nsteps = 1\ntolerance = {}\npreconditioner = \"{}\"", tolerance, preconditioner);
}
const std::string newton = "type = \"newton\"\nsteps = 1\ntolerance = 1e-10";

/// Iterations of GMRES of a whole run.
int krylov_iterations(const Protocol& protocol) {
  int sum = 0;
  for (std::size_t at = protocol.text.find("gmres"); at != std::string::npos; at = protocol.text.find("gmres", at + 1))
    sum += std::stoi(protocol.text.substr(at + 5));
  return sum;
}

}  // namespace

TEST_CASE("Krylov iterations hardly grow with the bulk modulus") {
  const Protocol soft = run(*build(scene(3, 8, 5, jfnk("auto")))), hard = run(*build(scene(3, 8, 1e4, jfnk("auto"))));
  MESSAGE(krylov_iterations(soft), " iterations with kappa/mu = 5, ", krylov_iterations(hard), " with 1e4");
  CHECK(soft.text.find("preconditioner companion") != std::string::npos);
  CHECK(hard.text.find("preconditioner mixed") != std::string::npos);
  CHECK(hard.reports.back().residual <= 1e-8);
  CHECK(krylov_iterations(hard) <= 3 * krylov_iterations(soft));
  CHECK(hard.iterations() <= soft.iterations() + 1);
}

TEST_CASE("prescribed motions of both ends: no step is cut back, and those that continue the path begin with the volumes of its points") {
  const std::string load = "[[load]]\nset = \"end\"\nforce = [0.05, 0, 0.1]\n";
  for (const int steps : {1, 3}) {
    std::string text = scene(3, 8, 1e4, fmt::format("type = \"jfnk\"\nsteps = {}\ntolerance = 1e-8", steps));
    text.replace(text.find(load), load.size(), "[[boundary]]\nset = \"end\"\ndisplacement = [0, 0, 0.15]\n");
    const Protocol protocol = run(*build(text));
    INFO(protocol.text);
    CHECK(protocol.text.find("preconditioner mixed") != std::string::npos);
    CHECK(protocol.text.find("no equilibrium") == std::string::npos);
    CHECK(protocol.reports.back().step == steps);
    CHECK(protocol.reports.back().residual <= 1e-8);
    CHECK(krylov_iterations(protocol) <= 200 * steps);
    // A continued step begins near equilibrium: pressures of its volumes would be a hundred reactions.
    if (steps == 1) continue;
    const std::size_t at = protocol.text.find("residual", protocol.text.find("step 2"));
    double residual = 0;
    REQUIRE(at != std::string::npos);
    REQUIRE(std::sscanf(protocol.text.c_str() + at, "residual %lf", &residual) == 1);
    CHECK(residual < 1);
  }
}

TEST_CASE("volumes that alternate between neighbours are warned of") {
  // A cube between held faces has a checkerboard of volumes that its displacements hardly change.
  const auto cube = [](double ratio) {
    return fmt::format(
        "format = 1\n[body]\ndimension = 3\n[body.lattice]\nspacing = 0.2\nlower = [0, 0, 0]\nupper = [1, 1, 1]\n"
        "[family]\nhorizon_ratio = 2.015\ninfluence = \"cubic_spline\"\n[kinematics]\ntype = \"selective\"\nbase = \"baqp\"\n"
        "[material]\ntype = \"neo_hookean\"\nshear_modulus = 1.0\nbulk_modulus = {}\n"
        "[[boundary]]\nface = \"-z\"\ndisplacement = [0, 0, 0]\n[[boundary]]\nface = \"+z\"\ndisplacement = [0, 0, 0.1]\n"
        "[integrator]\ntype = \"jfnk\"\nsteps = 1\ntolerance = 1e-8\n",
        ratio);
  };
  const std::string said = "volumes of points that alternate between neighbours";
  const auto soft = build(cube(100)), hard = build(cube(1e4));
  CHECK(run(*soft).text.find(said) == std::string::npos);
  const std::string text = run(*hard).text;
  REQUIRE(text.find(said) != std::string::npos);
  CHECK(text.rfind("warning: ", text.find(said)) != std::string::npos);
  const double of_soft = soft->problem().state().energies.strain, of_hard = hard->problem().state().energies.strain;
  MESSAGE("strain energy ", of_soft, " J with kappa/mu = 100, ", of_hard, " J with 1e4");
  CHECK(of_hard > 1.1 * of_soft);  // what is warned of
  // The block that is pulled by loads keeps its volumes.
  CHECK(run(*build(scene(3, 8, 1e4, jfnk("mixed")))).text.find(said) == std::string::npos);
}

TEST_CASE("auto takes mixed systems where they are faster: in 3D from a ratio of 20 on lattices, 50 on clouds") {
  for (const char* jitter : {"0", "0.2"})
    for (const double ratio : {18.0, 22.0, 45.0, 55.0}) {
      const bool expected = ratio >= (jitter[1] == 0 ? 20 : 50);
      INFO("jitter ", std::string(jitter), ", kappa/mu = ", ratio);
      CHECK((run(*build(scene(3, 5, ratio, jfnk("auto"), jitter))).text.find("preconditioner mixed") != std::string::npos) == expected);
    }
}

/// The half x > 0.5 of another material, whose moduli are these, and how the two meet.
std::string two_materials(const std::string& text, double shear, double bulk, const std::string& interfaces) {
  std::string both = text;
  both.replace(both.find("[family]\n"), 9, fmt::format("other = \"x > 0.5\"\n[family]\ninterfaces = \"{}\"\n", interfaces));
  const std::string region = fmt::format("[[region]]\nset = \"other\"\nmaterial = {{ type = \"neo_hookean\", shear_modulus = {}, bulk_modulus = {} }}\n", shear, bulk);
  return both.insert(both.find("[[boundary]]"), region);
}

TEST_CASE("two materials, of which one or both hardly change their volume: hardly more iterations, and newton's solution") {
  for (const char* interfaces : {"laminate", "parallel"})
    for (const char* jitter : {"0", "0.1"})
      for (const auto& [shear, bulk] : {std::pair{1.0, 1.5}, {1.0, 100.0}, {8.0, 16.0}, {0.2, 2000.0}}) {
        INFO(interfaces, ", jitter ", jitter, ", shear modulus ", shear, ", bulk modulus ", bulk);
        const std::string text = scene(3, 4, 1e4, jfnk("mixed", 1e-9), jitter);
        const auto exact = build(two_materials(scene(3, 4, 1e4, newton, jitter), shear, bulk, interfaces)), found = build(two_materials(text, shear, bulk, interfaces));
        run(*exact);
        const Protocol protocol = run(*found);
        CHECK(distance(*exact, *found) < 1e-7);
        CHECK(krylov_iterations(protocol) <= 300);
      }
}

TEST_CASE("auto leaves mixed systems where one material is far stiffer than the other") {
  for (const double shear : {20.0, 1 / 20.0, 50.0, 1 / 50.0}) {
    INFO("shear modulus ", shear);
    const std::string text = two_materials(scene(3, 4, 1e4, "type = \"jfnk\"\nsteps = 1\ntolerance = 0.9"), shear, 2 * shear, "parallel");
    CHECK((run(*build(text)).text.find("preconditioner mixed") != std::string::npos) == (shear > 1.0 / 30 && shear < 30));
  }
}

TEST_CASE("the stiffness of volumes is that of the energy where the whole body grows, laminates too") {
  for (const char* interfaces : {"laminate", "parallel"})
    for (const char* jitter : {"0", "0.1"}) {
      INFO(interfaces, ", jitter ", jitter);
      const auto simulation = build(two_materials(scene(3, 5, 100, jfnk("mixed"), jitter), 0.5, 3.0, interfaces));
      BodyProblem& problem = simulation->problem();
      const std::unique_ptr<VolumetricPart> volumes = problem.volumetric_part();
      Field u = problem.make_field(), force = problem.make_field();
      REQUIRE(volumes->linearise(u).ok());
      double sum = 0;
      for (const std::int32_t p : problem.body().internal()) sum += volumes->stiffness().data[p];
      const auto energy_at = [&](double growth) {  // F = exp(growth/3) I
        for (const std::int32_t p : problem.body().internal())
          for (int c = 0; c < 3; ++c)
            u.component(c)[p] = std::expm1(growth / 3) * problem.body().position(static_cast<std::size_t>(p))[static_cast<std::size_t>(c)];
        double energy = 0;
        REQUIRE(problem.evaluate_forces({u, 0}, force, &energy).ok());
        return energy;
      };
      constexpr double t = 1e-3;
      CHECK(sum == doctest::Approx((energy_at(t) + energy_at(-t)) / (t * t)).epsilon(1e-5));
    }
}

TEST_CASE("newton's solution, on lattices and clouds, with images, in 2D and 3D, with differences too") {
  struct Variant {
    int dimension, cells;
    std::string jitter, more, keys;
  };
  const std::string symmetric = "[[symmetry]]\naxis = \"x\"\n";
  for (const auto& [dimension, cells, jitter, more, keys] :
       {Variant{3, 4, "0", "", ""}, Variant{3, 4, "0.1", "", ""}, Variant{2, 9, "0", "", "\ntangent = \"differences\""},
        Variant{2, 9, "0", symmetric, ""}, Variant{2, 9, "0.1", symmetric, ""}}) {
    for (const double ratio : {5.0, 1e4}) {
      INFO(dimension, "D, kappa/mu = ", ratio, ", jitter ", jitter, " ", more);
      const auto exact = build(scene(dimension, cells, ratio, newton, jitter, more)),
                 found = build(scene(dimension, cells, ratio, jfnk("mixed", 1e-9) + keys, jitter, more));
      run(*exact);
      run(*found);
      CHECK(mean(*exact, "end", dimension - 1) > 1e-3);
      CHECK(distance(*exact, *found) < 1e-7);
    }
  }
}

TEST_CASE("bonds that fail: newton's solution and newton's bonds") {
  const std::string damage = "[damage]\ntype = \"critical_stretch\"\nstretch = 0.1\n";
  const auto exact = build(scene(2, 9, 1000, newton, "0", damage)),
             found = build(scene(2, 9, 1000, jfnk("mixed", 1e-9), "0", damage));
  run(*exact);
  run(*found);
  CHECK(!exact->problem().families().changed().empty());
  CHECK(exact->problem().families().changed().size() == found->problem().families().changed().size());
  CHECK(distance(*exact, *found) < 1e-6);
}

TEST_CASE("bitwise the same for any number of threads") {
  std::vector<std::unique_ptr<Simulation>> found;
  const int before = thread_count();
  for (const int threads : {1, 3}) {
    set_thread_count(threads);
    found.push_back(build(scene(3, 5, 1e4, jfnk("mixed"))));
    run(*found.back());
  }
  set_thread_count(before);
  CHECK(distance(*found[0], *found[1]) == 0);
}

TEST_CASE("mixed is refused without point volumes, and by kinsol") {
  std::string plain = scene(3, 3, 5, jfnk("mixed"));
  plain.replace(plain.find("\"selective\"\nbase = \"baqp\""), std::strlen("\"selective\"\nbase = \"baqp\""), "\"baqp\"");
  Protocol protocol;
  const auto words = doctest::Contains("integrator.preconditioner: found \"mixed\", which needs the point volumes of selective");
  CHECK_THROWS_WITH(build(plain)->run(protocol), words);
  CHECK_THROWS_WITH(build(plain)->summary(), words);   // `check`, and `run` before it writes anything
  CHECK_THROWS_WITH(build(scene(3, 3, 5, "type = \"kinsol\"\npreconditioner = \"mixed\"")), doctest::Contains("allowed: "));
}

TEST_CASE("mixed: the log says in how many iterations the linear residual fell, and to what share") {
  const Protocol protocol = run(*build(scene(2, 5, 100, jfnk("mixed"))));
  const std::size_t at = protocol.text.find("gmres ");
  REQUIRE(at != std::string::npos);
  int iterations = 0;
  double reached = 0;
  REQUIRE(std::sscanf(protocol.text.c_str() + at, "gmres %d to %lf", &iterations, &reached) == 2);
  CHECK(iterations > 0);
  CHECK(reached > 0);
  CHECK(reached < 0.9);
}
