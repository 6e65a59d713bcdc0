/// The companion preconditioner: springs between nearest neighbours under multigrid instead of the tangent.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <map>
#include <sstream>

#include "tests/kit/scene_text.hpp"
#include "tests/kit/vector_text.hpp"
#include "tests/validation/quasi_static.hpp"

using namespace perikit;
using namespace perikit::validation;
using contract::BodyOptions;

namespace {

/// A block of cells^3 points on three held layers, pulled and sheared by its other end.
std::unique_ptr<Simulation> block(const std::string& kinematics, int cells, const std::string& integrator, double poisson = 0.25,
                                  const std::string& jitter = "0") {
  const std::string text = fmt::format(
      "format = 1\n[body]\ndimension = 3\n[body.lattice]\nspacing = {0:.17g}\nlower = [0, 0, {1:.17g}]\nupper = [1, 1, "
      "1]\njitter = {5}\n"
      "[sets]\nheld = \"z < 0\"\nend = \"z > 1 - {0:.17g}\"\n[family]\nhorizon_ratio = 2.015\ninfluence = "
      "\"cubic_spline\"\n[kinematics]\n{2}\n"
      "[material]\ntype = \"saint_venant_kirchhoff\"\nyoungs_modulus = 1.0e6\npoisson_ratio = {3}\n"
      "[[boundary]]\nset = \"held\"\ndisplacement = [0, 0, 0]\n[[load]]\nset = \"end\"\nforce = [3.0e4, 0, "
      "5.0e4]\n[integrator]\n{4}\n",
      1.0 / cells, -3.0 / cells, kinematics, poisson, integrator, jitter);
  return build(text);
}

const std::string companion = "type = \"jfnk\"\nsteps = 1\ntolerance = 1e-8\npreconditioner = \"companion\"\nmax_restarts = 0\n";

/// Iterations of GMRES in the first linear solve, which is to 1e-3 everywhere.
int first_iterations(const Protocol& protocol) {
  std::istringstream text(protocol.text.substr(protocol.text.find("gmres") + 5));
  int iterations = 0;
  text >> iterations;
  return iterations;
}

}  // namespace

TEST_CASE("iterations hardly grow where points are refined, and do without it") {
  for (const std::string kinematics : {"type = \"baqp\"", "type = \"conventional\"\nstabilization = \"silling\""}) {
    INFO(kinematics);
    int with[2], without[2];
    for (const int k : {0, 1}) {
      const int cells = k == 0 ? 8 : 16;
      with[k] = first_iterations(run(*block(kinematics, cells, companion)));
      without[k] = first_iterations(
          run(*block(kinematics, cells, "type = \"jfnk\"\nsteps = 1\ntolerance = 1e-2\npreconditioner = \"none\"\n")));
    }
    MESSAGE(kinematics, ": ", with[0], " to ", with[1], ", without ", without[0], " to ", without[1]);
    CHECK(with[1] <= 1.3 * with[0] + 1);
    CHECK(with[1] <= 20);
    CHECK(without[1] > 2 * without[0]);
  }
}

TEST_CASE("the same solution as newton") {
  const std::string newton = "type = \"newton\"\nsteps = 1\ntolerance = 1e-10\n";
  const auto exact = block("type = \"baqp\"", 5, newton), found = block("type = \"baqp\"", 5, companion);
  run(*exact);
  run(*found);
  CHECK(mean(*exact, "end", 2) > 0.03);
  CHECK(distance(*exact, *found) < 1e-8);
}

TEST_CASE("every kinematics in every space, on lattices, clouds and cracked bodies of two materials") {
  auto& parts = contract::subject().parts;  // whose cases are wanted
  for (const Kind kind : {Kind::kinematics, Kind::stabilization})
    for (const std::string& name : registry().names(kind)) parts.emplace_back(kind, name);
  const std::vector<contract::Case> all = contract::cases();
  parts.clear();
  std::map<std::string, std::string> first;
  int count = 0;
  for (contract::Case body : all) {
    // `conventional` alone has modes without energy, for which no solver finds an answer in every case.
    if (!body.conservative() || (body.example.part == "conventional" && body.example.stabilization.empty())) continue;
    // The first example of each part.
    const std::string name = body.example.part + body.example.stabilization;
    if (!first.try_emplace(name, body.example.table).second && first[name] != body.example.table) continue;
    INFO(body.label());
    ++count;
    body.body.sets += "held = \"x < 2.01\"\nend = \"x > 4\"\n";
    body.body.cells = 7;
    // Moved by its end, by a little: poor families of cracked clouds do not carry much.
    body.body.conditions +=
        fmt::format("[[boundary]]\nset = \"held\"\ndisplacement = {}\n[[boundary]]\nset = \"end\"\ndisplacement = {}\n",
                    test::vector_text(body.body.dimension, 0, 0, 0), test::vector_text(body.body.dimension, 0.02, 0.01, 0));
    body.body.integrator = "type = \"jfnk\"\nsteps = 1\ntolerance = 1e-6\npreconditioner = \"companion\"\n";
    const auto simulation = build(contract::scene_text(body.body, contract::kinematics_table(body.example)));
    Protocol protocol;
    REQUIRE_NOTHROW(simulation->run(protocol));
    CHECK(protocol.reports.back().residual <= 1e-6);
  }
  CHECK(count > 80);
}

TEST_CASE("a part that only bonds longer than the springs join to the rest, and points that stand alone") {
  BodyOptions body;
  body.dimension = 2;
  body.cells = 12;  // and 10 along x
  body.horizon_ratio = 3.015;
  body.sets = "held = \"x < 2.01\"\nend = \"x > 8\"\n";
  body.conditions = "[[boundary]]\nset = \"held\"\ndisplacement = [0, 0]\n[[load]]\nset = \"end\"\nforce = [0.01, 0.01]\n";
  for (const std::string gap : {"x < 6 || x > 7", "x < 5 || (abs(y - 2.5) < 0.1 && abs(x - 6.5) < 0.1) || x > 7"}) {
    INFO(gap);
    std::vector<std::unique_ptr<Simulation>> found;
    for (const std::string& integrator : {companion, std::string("type = \"newton\"\nsteps = 1\ntolerance = 1e-9\n")}) {
      body.integrator = integrator;
      std::string text = contract::scene_text(body, "type = \"baqp\"");
      text.insert(text.find("[sets]"), "inside = \"" + gap + "\"\n");
      found.push_back(build(text));
      run(*found.back());
    }
    CHECK(mean(*found[1], "end", 0) > 1e-3);
    CHECK(distance(*found[0], *found[1]) < 1e-6);
  }
}

TEST_CASE("images behind held faces, planes of symmetry and periodic sides: in every space, as newton") {
  for (const auto& [d, space] : {std::pair(1, "strain"), std::pair(1, "stress"), std::pair(2, "strain"), std::pair(2, "stress"), std::pair(3, "")}) {
    const int dimension = d;
    const auto vector = [&](const std::string& x, const std::string& rest) { return test::vector_text(dimension, x, rest, rest); };
    const std::string sides[] = {
        fmt::format("[[boundary]]\nface = \"-x\"\ndisplacement = {}\n[[boundary]]\nface = \"+x\"\ndisplacement = {}\n", vector("0", "0"), vector("0.02", "\"free\"")),
        fmt::format("[[symmetry]]\naxis = \"x\"\nat = 0\n[[boundary]]\nset = \"end\"\ndisplacement = {}\n", vector("0.02", "0.01")),
        dimension == 1 ? "" : fmt::format("[[periodic]]\naxis = \"y\"\n[[boundary]]\nface = \"-x\"\ndisplacement = {}\n[[load]]\nset = \"end\"\nforce = {}\n", vector("0", "0"), vector("1e3", "0"))};
    for (const std::string& side : sides) {
      if (side.empty()) continue;
      INFO(dimension, "D ", std::string(space), " ", side);
      std::vector<std::unique_ptr<Simulation>> found;
      for (const std::string integrator : {"newton", "jfnk", "kinsol"}) {
        std::vector<double> upper{1, 0.6, 0.6};
        upper.resize(static_cast<std::size_t>(dimension));
        found.push_back(build(test::SceneText{.dimension = dimension, .space = space, .spacing = 0.1, .upper = upper, .sets = "end = \"x > 0.8\"",
                                              .material = "type = \"linear_elastic\"\nyoungs_modulus = 1e6\npoisson_ratio = 0.3", .further = side,
                                              .integrator = fmt::format("type = \"{}\"\nsteps = 1\n{}", integrator, integrator == "newton" ? "" : "preconditioner = \"companion\"")}));
        const Protocol protocol = run(*found.back());
        CHECK(protocol.reports.back().residual <= 1e-8);
        CHECK(distance(*found.front(), *found.back()) < 1e-7);
      }
      CHECK(mean(*found.front(), "end", 0) > 1e-3);
    }
  }
}

TEST_CASE("nearly incompressible: more iterations, still an answer") {
  const Protocol easy = run(*block("type = \"baqp\"", 9, companion, 0.25)),
                 hard = run(*block("type = \"baqp\"", 9, companion, 0.49));
  MESSAGE(first_iterations(easy), " and ", first_iterations(hard), " iterations");
  CHECK(hard.reports.back().residual <= 1e-8);
  CHECK(first_iterations(hard) < 60);
}
