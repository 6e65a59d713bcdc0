/// Pressure on free surfaces: a uniform stress in equilibrium point by point, exact totals, Lame's tube, and pressures that
/// follow the surface.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>

#include "perikit/core/field_operations.hpp"
#include "tests/contract/integrator_fixture.hpp"
#include "tests/validation/scenes.hpp"

using namespace perikit;
using namespace perikit::validation;

namespace {

struct BodyText {
  const char* body;
  int dimension;
  double right;  ///< beyond it lies the set "right"
};

const BodyText block{"dimension = 3\n[body.lattice]\nspacing = 0.1\nlower = [0, 0, 0]\nupper = [0.8, 0.7, 0.6]\n", 3, 0.7};
const BodyText plate{
    "dimension = 2\nplane = \"strain\"\nthickness = 0.5\n[body.lattice]\nspacing = 0.1\nlower = [0, 0]\nupper = [1.2, 1.0]\n", 2,
    1.1};
const BodyText ring{
    "dimension = 2\nplane = \"strain\"\n[body.lattice]\nspacing = 0.1\nlower = [-1, -1]\nupper = [1, 1]\ninside = \"x^2 + y^2 > "
    "0.2 && x^2 + y^2 < 1\"\n",
    2, 0.7};

std::unique_ptr<Simulation> under_pressure(const BodyText& body, const std::string& kinematics, const std::string& more) {
  const std::string text = fmt::format(
      "format = 1\n[body]\n{}[sets]\nright = \"x > {}\"\n[family]\nhorizon_ratio = 2.015\n[kinematics]\ntype = "
      "\"{}\"\n[material]\ntype = \"neo_hookean\"\ndensity = 1000.0\n"
      "shear_modulus = 1.0e6\nbulk_modulus = 2.0e6\n{}",
      body.body, body.right, kinematics, more);
  return build(text);
}

/// The largest sum of internal and external forces on a point over the largest external one.
double imbalance(Simulation& simulation, double stretch, double pressure) {
  BodyProblem& problem = simulation.problem();
  const int d = problem.dimension();
  Field u = problem.make_field(), force = problem.make_field(), external = problem.make_field();
  for (const std::int32_t p : problem.body().owned())
    for (int c = 0; c < d; ++c)
      u.component(c)[p] = (stretch - 1) * problem.body().position(static_cast<std::size_t>(p))[static_cast<std::size_t>(c)];
  REQUIRE(problem.evaluate_forces({u, 0}, force, nullptr).ok());
  REQUIRE(problem.external_forces({u, 1.0}, external).ok());
  double largest = 0, left = 0;
  for (const std::int32_t p : problem.body().owned())
    for (int c = 0; c < d; ++c) {
      largest = std::max(largest, std::abs(pressure * external.component(c)[p]));
      left = std::max(left, std::abs(force.component(c)[p] + pressure * external.component(c)[p]));
    }
  return left / largest;
}

/// First Piola-Kirchhoff stress over the plane of the body at F = stretch I (in the plane), from the law itself.
double stress(const BodyText& body, double stretch) {
  const auto simulation = under_pressure(body, "conventional", "[integrator]\ntype = \"evaluate\"\n");
  BodyProblem& problem = simulation->problem();
  const FieldView u = problem.state().displacement();
  for (const std::int32_t p : problem.body().owned())
    for (int c = 0; c < problem.dimension(); ++c)
      u.component(c)[p] = (stretch - 1) * problem.body().position(static_cast<std::size_t>(p))[static_cast<std::size_t>(c)];
  PointSamples samples;
  REQUIRE(problem.sample(samples).ok());
  return samples.P.component(0)[problem.body().owned().front()];
}

}  // namespace

TEST_CASE("a pressure all around holds a uniform stress in equilibrium, point by point, dead and following") {
  const std::string load = "[[load]]\nset = \"all\"\npressure = 1.0\nfollower = {}\n[integrator]\ntype = \"evaluate\"\n";
  for (const BodyText& body : {block, plate, ring})
    for (const char* kinematics :
         {"conventional", "baqp", "projection", "bond_associated", "sub_horizon", "non_spherical", "bond_augmented"})
      for (const bool follower : {false, true}) {
        const double stretch = 1.1, P = stress(body, stretch);
        // Dead: the stress on the surface is P itself. Following: -p cof F, with cof F = stretch^(d - 1) over the surface of d
        // dimensions.
        const double pressure = follower ? -P / std::pow(stretch, body.dimension - 1) : -P;
        const auto simulation = under_pressure(body, kinematics, fmt::format(fmt::runtime(load), follower));
        const double left = imbalance(*simulation, stretch, pressure);
        CHECK_MESSAGE(left < 1e-11, kinematics, " in ", body.dimension, "D, follower ", follower, ": ", left);
      }
}

TEST_CASE("a following pressure holds a uniform stress in equilibrium beside held faces and surfaces, point by point") {
  const std::string plane = "[initial]\ndisplacement = [\"0.1*x\", \"0.1*y\"]\n[[load]]\nset = \"all\"\npressure = 1.0\nfollower = true\n[integrator]\ntype = \"evaluate\"\n",
                    held = "displacement = [\"0.1*x\", \"0.1*y\"]\n", face = "[[boundary]]\nface = \"-x\"\n" + held;
  const std::string cloud = std::string(plate.body) + "jitter = 0.1\n";
  const double P = stress(plate, 1.1);
  struct Held {
    BodyText body;
    std::string sides;
  };
  for (const Held& c : {Held{plate, face}, Held{plate, face + "[[boundary]]\nface = \"+y\"\n" + held}, Held{plate, face + "[[symmetry]]\naxis = \"y\"\n"},
                        Held{{cloud.c_str(), 2, 1.1}, "[[boundary]]\nsurface = \"-0.04 - x\"\n" + held}})
    for (const char* kinematics : {"conventional", "baqp", "projection", "bond_associated", "sub_horizon", "bond_augmented"}) {
      INFO(kinematics, "\n", c.sides);
      const auto simulation = under_pressure(c.body, kinematics, plane + c.sides);
      BodyProblem& problem = simulation->problem();
      Field force = problem.make_field(), external = problem.make_field();
      const ConstFieldView u = problem.state().displacement();
      REQUIRE(problem.evaluate_forces({u, 0}, force, nullptr).ok());
      REQUIRE(problem.external_forces({u, 1.0}, external).ok());
      double largest = 0, left = 0;
      for (const std::int32_t p : problem.body().owned())
        for (int a = 0; a < 2; ++a) {
          const double load = -P / 1.1 * external.component(a)[p];
          largest = std::max(largest, std::abs(load));
          left = std::max(left, std::abs(force.component(a)[p] + load));
        }
      CHECK_MESSAGE(left <= 1e-11 * largest, "out of balance by ", left / largest);
      // The tangent of the load, in a direction that moves the face, too.
      Field w = problem.make_field(), K = problem.make_field(), ahead = problem.make_field(), behind = problem.make_field(), moved = problem.make_field();
      for (const std::int32_t p : problem.body().internal())
        for (int a = 0; a < 2; ++a) w.component(a)[p] = std::sin(3.0 * p + a);
      REQUIRE(problem.add_load_stiffness({u, 1.0}, w, K).ok());
      const double h = 1e-6;
      combine(1, u, h, w, moved);
      REQUIRE(problem.external_forces({moved, 1.0}, ahead).ok());
      combine(1, u, -h, w, moved);
      REQUIRE(problem.external_forces({moved, 1.0}, behind).ok());
      double off = 0;
      for (const std::int32_t p : problem.body().internal())
        for (int a = 0; a < 2; ++a) off = std::max(off, std::abs(K.component(a)[p] + (ahead.component(a)[p] - behind.component(a)[p]) / (2 * h)));
      CHECK_MESSAGE(off <= 1e-7 * largest_magnitude(K), "the tangent is off by ", off / largest_magnitude(K));
    }
}

TEST_CASE("a pressure all around holds a uniform one in equilibrium under selective kinematics, whose mean stress acts by the gradients of points") {
  const double stretch = 1.1, P = stress(block, stretch);
  for (const char* base : {"baqp", "projection", "bond_associated", "sub_horizon", "non_spherical", "bond_augmented"})
    for (const bool follower : {false, true}) {
      const auto simulation = under_pressure(block, fmt::format("selective\"\nbase = \"{}", base),
                                             fmt::format("[[load]]\nset = \"all\"\npressure = 1.0\nfollower = {}\n[integrator]\ntype = \"evaluate\"\n", follower));
      const double left = imbalance(*simulation, stretch, follower ? -P / (stretch * stretch) : -P);
      CHECK_MESSAGE(left < 1e-11, base, ", follower ", follower, ": ", left);
    }
}

namespace {

/// A uniform expansion of a body with a pair law under a pressure on all of its surface.
struct Expansion {
  double left;       ///< largest sum of internal and external forces on a point over the largest external one, under the pressure that fits best
  double pressure;   ///< that pressure, minus it
  double stress;     ///< of the point that is farthest from the surface
  double total;      ///< largest component of the sum of the external forces over the sum of their sizes
};

Expansion expansion(Simulation& simulation, double stretch, const Point& middle) {
  BodyProblem& problem = simulation.problem();
  const Body& body = problem.body();
  const int d = problem.dimension();
  Field force = problem.make_field(), external = problem.make_field();
  const FieldView u = problem.state().displacement();
  for (const std::int32_t p : body.internal())
    for (int c = 0; c < d; ++c) u.component(c)[p] = (stretch - 1) * body.position(static_cast<std::size_t>(p))[static_cast<std::size_t>(c)];
  if (problem.images()) contract::to_problem(problem, u);
  REQUIRE(problem.evaluate_forces({u, 0}, force, nullptr).ok());
  REQUIRE(problem.external_forces({u, 1.0}, external).ok());
  Expansion found{};
  double both = 0, square = 0, sizes = 0;
  std::array<double, 3> sum{};
  for (const std::int32_t p : body.owned())
    for (int c = 0; c < d; ++c) {
      const double f = external.component(c)[p];
      both += force.component(c)[p] * f;
      square += f * f;
      sum[static_cast<std::size_t>(c)] += f;
      sizes += std::abs(f);
    }
  found.pressure = -both / square;
  double largest = 0;
  for (const std::int32_t p : body.owned())
    for (int c = 0; c < d; ++c) {
      const double f = found.pressure * external.component(c)[p];
      largest = std::max(largest, std::abs(f));
      found.left = std::max(found.left, std::abs(force.component(c)[p] + f));
    }
  found.left /= largest;
  for (int c = 0; c < d; ++c) found.total = std::max(found.total, std::abs(sum[static_cast<std::size_t>(c)]) / sizes);
  PointSamples samples;
  REQUIRE(problem.sample(samples).ok());
  const auto away = [&](std::int32_t p) {
    double square_of = 0;
    for (std::size_t c = 0; c < static_cast<std::size_t>(d); ++c) square_of += std::pow(body.position(static_cast<std::size_t>(p))[c] - middle[c], 2);
    return square_of;
  };
  found.stress = samples.P.component(0)[*std::ranges::min_element(body.owned(), {}, away)];
  return found;
}

std::string pair_scene(const std::string& body, const std::string& law, const std::string& more) {
  return fmt::format("format = 1\n[body]\n{}[sets]\nright = \"x > 1.1\"\n[family]\nhorizon_ratio = 2.015\n[kinematics]\n{}\n[material]\ntype = \"linear_elastic\"\ndensity = 1000.0\n"
                     "youngs_modulus = 3.0e6\npoisson_ratio = 0.3\n{}[integrator]\ntype = \"evaluate\"\n",
                     body, law, more);
}

constexpr const char* pair_laws[] = {"type = \"bond_based\"\nsurface_correction = \"none\"", "type = \"bond_based\"\nsurface_correction = \"energy\"", "type = \"ordinary\"\nsurface_correction = \"none\"",
                                     "type = \"ordinary\"\nsurface_correction = \"energy\""};

}  // namespace

TEST_CASE("pair laws: a pressure all around holds a uniform expansion in equilibrium, point by point, dead and following, on lattices and clouds") {
  const std::string line = "dimension = 1\nline = \"strain\"\n[body.lattice]\nspacing = 0.1\nlower = [0]\nupper = [2]\n",
                    sheet = "dimension = 2\nplane = \"strain\"\nthickness = 0.5\n[body.lattice]\nspacing = 0.1\nlower = [0, 0]\nupper = [1.4, 1.2]\n",
                    cube = "dimension = 3\n[body.lattice]\nspacing = 0.1\nlower = [0, 0, 0]\nupper = [1.2, 1.1, 1.0]\n",
                    hole = "dimension = 2\nplane = \"strain\"\n[body.lattice]\nspacing = 0.1\nlower = [0, 0]\nupper = [2.2, 2.2]\ninside = \"(x - 0.5)^2 + (y - 0.4)^2 > 0.05\"\n";
  struct PairCase {
    std::string body;
    Point middle;
  };
  for (const PairCase& c : {PairCase{line, {1, 0, 0}}, PairCase{sheet, {0.7, 0.6, 0}}, PairCase{cube, {0.6, 0.55, 0.5}}, PairCase{hole, {1.4, 1.4, 0}}})
    for (const char* law : pair_laws)
      for (const bool cloud : {false, true})
        for (const bool follower : {false, true}) {
          INFO(std::string(law), " ", c.body, std::string(cloud ? "jitter" : ""), " follower ", follower);
          const double stretch = 1.1;
          const auto simulation = build(pair_scene(c.body + (cloud ? "jitter = 0.2\n" : ""), law, fmt::format("[[load]]\nset = \"all\"\npressure = 1.0\nfollower = {}\n", follower)));
          const int d = simulation->problem().dimension();
          const Expansion found = expansion(*simulation, stretch, c.middle);
          CHECK_MESSAGE(found.left <= 1e-11, "out of balance by ", found.left);
          CHECK_MESSAGE(found.total <= 1e-13, "the forces sum to ", found.total, " of their sizes");
          const double wanted = follower ? found.stress / std::pow(stretch, d - 1) : found.stress;
          // On a cloud one point has another stress than the median of those inside.
          CHECK_MESSAGE(std::abs(found.pressure + wanted) <= (cloud ? 0.4 : 1e-11) * std::abs(wanted), "the pressure is ", found.pressure, " for ", -wanted);
        }
}

TEST_CASE("pair laws: a pressure that follows holds a uniform expansion in equilibrium beside held faces and planes of symmetry, and its stiffness is its derivative") {
  const std::string sheet = "dimension = 2\nplane = \"strain\"\nthickness = 0.5\n[body.lattice]\nspacing = 0.1\nlower = [0, 0]\nupper = [1.4, 1.2]\n",
                    held = "[[boundary]]\nface = \"-x\"\ndisplacement = [\"0.1*x\", \"0.1*y\"]\n", symmetry = "[[symmetry]]\naxis = \"y\"\n",
                    load = "[[load]]\nset = \"all\"\npressure = 1.0\nfollower = true\n";
  for (const char* law : pair_laws)
    for (const bool cloud : {false, true})
      for (const std::string& sides : {held, symmetry, held + symmetry}) {
        INFO(std::string(law), std::string(cloud ? " cloud " : " lattice "), sides);
        const auto simulation = build(pair_scene(sheet + (cloud ? "jitter = 0.2\n" : ""), law, load + sides));
        BodyProblem& problem = simulation->problem();
        const Expansion found = expansion(*simulation, 1.1, {0.7, 0.6, 0});
        CHECK_MESSAGE(found.left <= 1e-11, "out of balance by ", found.left);
        const ConstFieldView u = problem.state().displacement();
        Field w = problem.make_field(), K = problem.make_field(), ahead = problem.make_field(), behind = problem.make_field(), moved = problem.make_field();
        for (const std::int32_t p : problem.body().internal())
          for (int a = 0; a < 2; ++a) w.component(a)[p] = std::sin(3.0 * p + a);
        REQUIRE(problem.add_load_stiffness({u, 1.0}, w, K).ok());
        const double h = 1e-6;
        combine(1, u, h, w, moved);
        REQUIRE(problem.external_forces({moved, 1.0}, ahead).ok());
        combine(1, u, -h, w, moved);
        REQUIRE(problem.external_forces({moved, 1.0}, behind).ok());
        double off = 0;
        for (const std::int32_t p : problem.body().internal())
          for (int a = 0; a < 2; ++a) off = std::max(off, std::abs(K.component(a)[p] + (ahead.component(a)[p] - behind.component(a)[p]) / (2 * h)));
        CHECK_MESSAGE(off <= 1e-7 * largest_magnitude(K), "the tangent is off by ", off / largest_magnitude(K));
      }
}

TEST_CASE("pressure: exact totals, on one side and on a hole") {
  for (const char* kinematics : {"baqp", "bond_based"}) {
    const auto total = [&](const BodyText& body, const std::string& load, int component) {
      const auto simulation =
          under_pressure(body, kinematics, fmt::format("[[load]]\n{}\n[integrator]\ntype = \"evaluate\"\n", load));
      Field force = simulation->problem().make_field();
      simulation->problem().loads().evaluate(1.0, force);
      double sum = 0;
      for (const std::int32_t p : simulation->problem().body().owned()) sum += force.component(component)[p];
      return sum;
    };
    CHECK(total(plate, "set = \"right\"\npressure = 2.0\nface = \"+x\"", 0) == doctest::Approx(-2.0 * 1.0 * 0.5).epsilon(1e-12));
    CHECK(total(plate, "set = \"right\"\npressure = 2.0", 0) == doctest::Approx(-2.0 * 1.0 * 0.5).epsilon(1e-12));
    CHECK(std::abs(total(plate, "set = \"right\"\npressure = 2.0", 1)) < 1e-13);
    CHECK(std::abs(total(plate, "set = \"all\"\npressure = 2.0", 0)) < 1e-13);
    CHECK(std::abs(total(ring, "set = \"all\"\npressure = 2.0", 1)) < 1e-13);
    CHECK(total(block, "set = \"right\"\npressure = \"2 + 0*x\"", 0) == doctest::Approx(-2.0 * 0.7 * 0.6).epsilon(1e-12));
  }
}

TEST_CASE("a pressure on one side is the same on both halves of it, and where the body lies elsewhere") {
  // Points in a corner between the side and another one are equally near to both.
  const auto forces = [](double shift, bool cloud) {
    const std::string cells = cloud ? "jitter = 1e-13\n" : "";
    const std::string text = fmt::format("dimension = 2\nplane = \"strain\"\n[body.lattice]\nspacing = 0.1\nlower = [{0}, {0}]\nupper = [{1}, {2}]\n{3}",
                                         shift, shift + 1.2, shift + 0.9, cells);
    const auto simulation = under_pressure({text.c_str(), 2, shift + 1.1}, "baqp", "[[load]]\nset = \"right\"\npressure = 2.0\n[integrator]\ntype = \"evaluate\"\n");
    const Body& body = simulation->problem().body();
    Field force = simulation->problem().make_field();
    simulation->problem().loads().evaluate(1.0, force);
    std::vector<std::array<double, 2>> rows;   // by the order of the points in the input: row by row
    for (std::size_t n = 0; n < 12 * 9; ++n) {
      const std::int32_t p = *std::ranges::find_if(body.owned(), [&](std::int32_t q) { return body.number(static_cast<std::size_t>(q)) == static_cast<std::int64_t>(n); });
      rows.push_back({force.component(0)[p], force.component(1)[p]});
    }
    return rows;
  };
  for (const bool cloud : {false, true}) {
    const auto here = forces(0.0, cloud), there = forces(0.37, cloud);
    double largest = 0, mirrored = 0, shifted = 0;
    for (std::size_t n = 0; n < here.size(); ++n) {
      const auto& other = here[n % 12 + 12 * (8 - n / 12)];
      largest = std::max(largest, std::abs(here[n][0]));
      mirrored = std::max({mirrored, std::abs(here[n][0] - other[0]), std::abs(here[n][1] + other[1])});
      shifted = std::max({shifted, std::abs(here[n][0] - there[n][0]), std::abs(here[n][1] - there[n][1])});
    }
    CHECK_MESSAGE(mirrored < 1e-11 * largest, "cloud ", cloud, ": ", mirrored / largest);
    CHECK_MESSAGE(shifted < 1e-11 * largest, "cloud ", cloud, ": ", shifted / largest);
  }
}

TEST_CASE("the stiffness of a pressure that follows is its derivative") {
  const auto simulation = under_pressure(
      ring, "baqp", "[[load]]\nset = \"all\"\npressure = \"1e5*(1 + 0.2*x)\"\nfollower = true\n[integrator]\ntype = \"evaluate\"\n");
  BodyProblem& problem = simulation->problem();
  Field u = problem.make_field(), w = problem.make_field(), Kw = problem.make_field(), plus = problem.make_field(),
        minus = problem.make_field();
  for (const std::int32_t p : problem.body().owned()) {
    const Point x = problem.body().position(static_cast<std::size_t>(p));
    u.component(0)[p] = 0.1 * std::sin(x[1]);
    u.component(1)[p] = 0.05 * x[0] * x[1];
    w.component(0)[p] = std::cos(2 * x[0]);
    w.component(1)[p] = x[1] * x[1];
  }
  REQUIRE(problem.add_load_stiffness({u, 1.0}, w, Kw).ok());
  const double h = 0.01;  // the force is quadratic in u: no error of the differences but rounding
  Field moved = problem.make_field();
  combine(1, u, h, w, moved);
  REQUIRE(problem.external_forces({moved, 1.0}, plus).ok());
  combine(1, u, -h, w, moved);
  REQUIRE(problem.external_forces({moved, 1.0}, minus).ok());
  combine(1 / (2 * h), minus, -1 / (2 * h), plus, plus);
  combine(1, plus, -1, Kw, moved);
  CHECK(norm(moved) < 1e-9 * norm(Kw));
}

TEST_CASE("Lame's tube: the displacement converges to the closed form") {
  const auto error = [](int n, const std::string& kinematics) {
    const auto simulation =
        load("pressure/lame_cylinder.toml", {fmt::format("constants.n={}", n), "kinematics.type=" + kinematics});
    contract::run(*simulation);
    BodyProblem& problem = simulation->problem();
    const HistoryDescription& record = simulation->scene().output.history[0];
    double distance = 0, size = 0;
    for (const std::int32_t p : problem.body().owned()) {
      const double exact = (*record.exact)(problem.body().position(static_cast<std::size_t>(p)), 1.0);
      distance += std::pow(problem.state().displacement().component(0)[p] - exact, 2);
      size += exact * exact;
    }
    return std::sqrt(distance / size);
  };
  for (const char* kinematics : {"baqp", "bond_associated"}) {
    const double coarse = error(20, kinematics), fine = error(60, kinematics);
    MESSAGE(std::string(kinematics), ": ", coarse, " at 20 cells to the radius, ", fine, " at 60");
    CHECK(fine < 0.012);
    CHECK(fine < coarse / 3);  // the first power of the spacing
  }
}

TEST_CASE("a pressure that follows a closed surface is conservative: an explicit run keeps its energy") {
  const auto simulation = under_pressure(ring, "projection",
                                         "[[load]]\nset = \"all\"\npressure = \"2e4*(1 - exp(-t/0.02))\"\nfollower = "
                                         "true\n[integrator]\ntype = \"verlet\"\nsafety = 0.2\nend_time = 0.2\n"
                                         "[output]\nhistory_every = 1\n");
  const contract::Watch watch = contract::run(*simulation);
  const double work = std::abs(simulation->problem().state().energies.external_work);
  CHECK(work > 0);
  CHECK_MESSAGE(watch.imbalance() < 1e-3 * work, watch.imbalance(), " of ", work, " J");
}

TEST_CASE("newton and jfnk find the same inflated ring") {
  const auto inflate = [](const std::string& integrator) {
    auto simulation = under_pressure(
        ring, "baqp",
        "[[boundary]]\nset = \"right\"\ndisplacement = [0, 0]\n[[load]]\nset = \"all\"\npressure = \"-2e4\"\nfollower = true\n"
        "[integrator]\ntype = \"" +
            integrator + "\"\nsteps = 2\ntolerance = 1e-9\nmax_iterations = 60\n");
    contract::run(*simulation);
    return simulation;
  };
  const auto a = inflate("newton"), b = inflate("jfnk");
  Field difference = a->problem().make_field();
  combine(1, a->problem().state().displacement(), -1, b->problem().state().displacement(), difference);
  CHECK(norm(a->problem().state().displacement()) > 0);
  CHECK(norm(difference) < 1e-6 * norm(a->problem().state().displacement()));
}

TEST_CASE("newton with a pressure that follows: the tangent of the load is in its equations, and load steps need no cut-back") {
  // A cantilever that an end couple rolls up.
  const auto rolled = [](const std::string& integrator) {
    return build("format = 1\n[body]\ndimension = 2\nplane = \"stress\"\n[body.lattice]\nspacing = 0.25\nlower = [0, -0.5]\nupper = [6, 0.5]\n[sets]\nend = \"x > 5.75\"\n"
                    "pin = { nearest = [0, 0] }\n[family]\nhorizon_ratio = 2.515\ninfluence = \"gaussian\"\n[kinematics]\ntype = \"projection\"\n[material]\n"
                    "type = \"saint_venant_kirchhoff\"\nyoungs_modulus = 1000.0\npoisson_ratio = 0.0\n[[symmetry]]\naxis = \"x\"\n[[boundary]]\nset = \"pin\"\ndisplacement = "
                    "[\"free\", 0]\n[[load]]\nset = \"end\"\nface = \"+x\"\npressure = \"-120*y\"\nfollower = true\n[integrator]\nsteps = 6\n" + integrator);
  };
  const auto reference = rolled("type = \"jfnk\"\n");
  contract::run(*reference);
  const ConstFieldView u = reference->problem().state().displacement();
  CHECK(largest_magnitude(u) > 1);
  for (const std::string solver : {"auto", "direct", "krylov"}) {
    INFO(solver);
    const auto found = rolled("type = \"newton\"\nlinear_solver = \"" + solver + "\"\n");
    contract::run(*found);
    CHECK(found->problem().state().step == 6);
    Field difference = found->problem().make_field();
    combine(1, found->problem().state().displacement(), -1, u, difference);
    CHECK(norm(difference) < 1e-5 * norm(u));
  }
}
