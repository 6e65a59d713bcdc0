/// Faces, planes of symmetry and periodic sides. What holds a face is a displacement like any other, so that forces, reactions and tangents are
/// derivatives over it too; a homogeneous stress between held faces is in equilibrium; half a body and its image are the whole.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <map>

#include "perikit/core/parallel.hpp"
#include "perikit/problem/motion.hpp"
#include "tests/contract/fixture.hpp"
#include "tests/kit/matrices.hpp"

using namespace perikit;
using namespace perikit::contract;

namespace {

std::string held(const char* face, const char* displacement) {
  return fmt::format("[[boundary]]\nface = \"{}\"\ndisplacement = {}\n", face, displacement);
}
std::string symmetric(char axis) { return fmt::format("[[symmetry]]\naxis = \"{}\"\n", axis); }
std::string periodic(char axis) { return fmt::format("[[periodic]]\naxis = \"{}\"\n", axis); }

/// A hole of radius 20 beside the body, whose rim is held, and a plane that meets it.
std::string held_surface(int dimension) {
  const char* const level[]{"-0.1 - x", "20 - sqrt((x + 20.1)^2 + (y - 4)^2)", "20 - sqrt((x + 20.1)^2 + (y - 2)^2 + (z - 1)^2)"};
  const char* const displacement[]{"[0.1]", "[0.1, \"0.1*y\"]", "[0.1, \"0.1*y\", \"0.1*x\"]"};
  return fmt::format("[[boundary]]\nsurface = \"{}\"\ndisplacement = {}\n", level[dimension - 1], displacement[dimension - 1]) +
         (dimension > 1 ? symmetric('y') : "");
}

/// Every kinematics between faces of all sorts, on lattices and clouds, in two mixtures a dimension; a cracked body of two materials among them.
/// On clouds there is a curved surface, too.
std::vector<Case> cases_with_images() {
  const std::array<std::array<std::string, 2>, 3> mixtures{{
      {held("-x", "[0.0]"), periodic('x')},
      {held("-x", "[0.1, \"0.1*y\"]") + symmetric('y'), held("-y", "[\"free\", 0.2]") + held("+y", "[0.1, \"free\"]") + periodic('x')},
      {held("-x", "[0.1, 0.0, \"0.1*z\"]") + symmetric('y') + periodic('z'), held("+z", "[0.1, \"free\", 0.0]") + held("-y", "[0.0, 0.1, 0.0]")},
  }};
  std::vector<Case> all;
  for (const Example& example : kinematics_examples())
    for (int d = 1; d <= 3; ++d) {
      for (int k = 0; k < 2; ++k)
        for (const bool cloud : {false, true}) {
          if (d == 3 && cloud == (k == 0)) continue;   // in 3D, where they take the longest, one of each
          BodyOptions body;
          body.dimension = d;
          body.cloud = cloud;
          body.cells = d == 3 ? 6 : d == 2 ? 9 : 20;
          body.crack = body.two_materials = k == 1 && d > 1;
          // Between faces torn families see strains at which saint_venant_kirchhoff is not stable: laminates of it need not exist there.
          if (body.two_materials) body.material = "type = \"neo_hookean\"\nyoungs_modulus = 2.0\npoisson_ratio = 0.3";
          body.conditions = mixtures[static_cast<std::size_t>(d - 1)][static_cast<std::size_t>(k)];
          all.push_back({example, body});
        }
      BodyOptions body;
      body.dimension = d;
      body.cloud = body.two_materials = true;
      body.material = "type = \"neo_hookean\"\nyoungs_modulus = 2.0\npoisson_ratio = 0.3";
      body.cells = d == 3 ? 6 : d == 2 ? 9 : 20;
      body.conditions = held_surface(d);
      all.push_back({example, body});
    }
  return all;
}

}  // namespace

TEST_CASE("kinematics: between faces force = -dE/du and reaction = dE/dU, the tangent is their derivative, symmetric, and the assembled one") {
  for (const Case& c : cases_with_images()) {
    INFO(c.label(), "\n", c.body.conditions);
    const auto simulation = build(scene_text(c.body, kinematics_table(c.example)));
    BodyProblem& problem = simulation->problem();
    const Body& body = problem.body();
    REQUIRE(problem.images());
    REQUIRE(body.points() > body.owned().size());
    const FieldView u = problem.state().displacement();
    deform(body, u, 101, 0.01);
    to_problem(problem, u);
    const Derivatives at = derivatives_at(problem, u, 102, 1e-3 * body.spacing());
    if (c.conservative()) CHECK_MESSAGE(at.force <= 1e-7, "force is not -dE/du: off by ", at.force);
    CHECK_MESSAGE(at.tangent <= 1e-7, "tangent is not dF/du: off by ", at.tangent);
    if (c.conservative()) CHECK_MESSAGE(at.asymmetry <= 1e-12, "tangent is not symmetric: off by ", at.asymmetry);
    BlockMatrix K;
    const EvaluationStatus status = problem.assemble_tangent({u, 0}, K);
    REQUIRE_MESSAGE(status.ok(), status.description);
    const double off = test::product_error(problem, K, at.w, at.Kw);
    CHECK_MESSAGE(off <= 1e-12, "the assembled tangent is off by ", off);
  }
}

TEST_CASE("kinematics: forces and reactions between faces sum to zero, the same bits for 1, 2 and 3 threads") {
  for (const Case& c : cases_with_images()) {
    INFO(c.label(), "\n", c.body.conditions);
    const auto simulation = build(scene_text(c.body, kinematics_table(c.example)));
    BodyProblem& problem = simulation->problem();
    const Body& body = problem.body();
    const FieldView u = problem.state().displacement();
    deform(body, u, 111, 0.01);
    to_problem(problem, u);
    const int threads = thread_count();
    set_thread_count(1);
    double energy = 0;
    const Field f = force_of(problem, u, &energy);
    for (const int n : {2, 3}) {
      set_thread_count(n);
      double other = 0;
      const Field g = force_of(problem, u, &other);
      CHECK_MESSAGE((other == energy && difference(body, f, g) == 0), n, " threads give other bits");
    }
    set_thread_count(threads);
    // All moves by 1 along an axis, faces with it: that needs no work.
    for (int a = 0; a < body.dimension(); ++a) {
      Field shift = problem.make_field();
      set_field(body, shift, [&](const Point&) { return Point{a == 0 ? 1.0 : 0.0, a == 1 ? 1.0 : 0.0, a == 2 ? 1.0 : 0.0}; });
      to_problem(problem, shift);
      const double total = dot(body, f, shift);
      CHECK_MESSAGE(std::abs(total) <= 1e-11 * largest(body, f), "forces and reactions along ", "xyz"[a], " sum to ", total);
    }
  }
}

TEST_CASE("kinematics: a homogeneous stress between held faces of a lattice is in equilibrium, and the reaction is stress times area") {
  for (const Example& example : kinematics_examples())
    for (int d = 1; d <= 3; ++d) {
      BodyOptions options;
      options.dimension = d;
      options.cells = d == 3 ? 6 : 9;
      const std::array<const char*, 3> displacement{"[0.0]", "[0.0, 0.0]", "[0.0, 0.0, 0.0]"};
      options.conditions = held("-x", displacement[static_cast<std::size_t>(d - 1)]) + held("+x", displacement[static_cast<std::size_t>(d - 1)]);
      for (int a = 1; a < d; ++a) options.conditions += periodic("xyz"[a]);
      INFO(Case{example, options}.label());
      const auto simulation = build(scene_text(options, kinematics_table(example)));
      BodyProblem& problem = simulation->problem();
      if (!problem.terms().conservative()) continue;
      const Body& body = problem.body();
      const Point stretch{0.05, 0.03, -0.02};
      const FieldView u = problem.state().displacement();
      set_field(body, u, [&](const Point& x) { return Point{stretch[0] * x[0], stretch[1] * x[0], stretch[2] * x[0]}; });
      to_problem(problem, u);
      REQUIRE(problem.evaluate_forces({u, 0}, problem.state().internal_force(), nullptr).ok());
      const ConstFieldView f = problem.state().internal_force();
      double out_of_balance = 0, largest_force = 0;
      for (const std::int32_t p : body.owned())
        for (int a = 0; a < d; ++a) out_of_balance = std::max(out_of_balance, std::abs(f.component(a)[p]));
      const Field r = reactions(problem, false, 0);
      Point lower{}, upper{};
      double volume = 0, middle = 0;
      for (const std::int32_t p : body.owned()) {
        volume += body.volume(static_cast<std::size_t>(p));
        middle += body.position(static_cast<std::size_t>(p))[0] / static_cast<double>(body.owned().size());
      }
      for (const std::int32_t p : body.owned())
        for (int a = 0; a < d; ++a) {
          largest_force = std::max(largest_force, std::abs(r.component(a)[p]));
          (body.position(static_cast<std::size_t>(p))[0] < middle ? lower : upper)[static_cast<std::size_t>(a)] += r.component(a)[p];
        }
      REQUIRE(largest_force > 0);
      CHECK_MESSAGE(out_of_balance <= 1e-11 * largest_force, "out of balance by ", out_of_balance / largest_force, " of the largest reaction");
      const double length = 2 * middle, area = volume / length;
      for (std::size_t a = 0; a < static_cast<std::size_t>(d); ++a) {
        CHECK_MESSAGE(std::abs(lower[a] + upper[a]) <= 1e-10 * std::abs(upper[0]), "the reactions of both faces are ", lower[a], " and ", upper[a]);
        if (!problem.terms().has_gradients()) continue;
        PointSamples samples;
        REQUIRE(problem.sample(samples).ok());
        const double stress = samples.P.component(static_cast<int>(a) * d)[body.owned().front()];
        CHECK_MESSAGE(std::abs(upper[a] - stress * area) <= 1e-10 * std::abs(upper[0]), "the reaction is ", upper[a], ", stress times area ", stress * area);
      }
    }
}

TEST_CASE("kinematics: what a held face prescribes along it is the same beyond a periodic side, whichever axis comes first") {
  for (const Example& example : kinematics_examples()) {
    BodyOptions options;
    options.dimension = 2;
    options.cells = 8;
    const auto energy = [&](bool x_first) {
      options.conditions = x_first ? held("-x", "[\"0.1 + 0.01*y\", \"0.02*y\"]") + periodic('y') : held("-y", "[\"0.02*x\", \"0.1 + 0.01*x\"]") + periodic('x');
      std::string text = scene_text(options, kinematics_table(example));
      const std::string oblong = "upper = [6, 8]";
      REQUIRE(text.find(oblong) != std::string::npos);
      text.replace(text.find(oblong), oblong.size(), "upper = [7, 7]");
      const auto simulation = build(text);
      BodyProblem& problem = simulation->problem();
      double energy = 0;
      REQUIRE(problem.evaluate_forces({problem.state().displacement(), 0}, problem.state().internal_force(), &energy).ok());
      return energy;
    };
    const double expected = energy(true);
    INFO(Case{example, options}.label());
    CHECK(expected > 0);
    CHECK(std::abs(energy(false) - expected) <= 1e-12 * expected);
  }
}

TEST_CASE("kinematics: half a lattice and its image are the whole") {
  for (const Example& example : kinematics_examples())
    for (int d = 1; d <= 3; ++d) {
      BodyOptions options;
      options.dimension = d;
      options.cells = d == 3 ? 7 : 8;
      options.two_materials = d > 1;
      const std::string whole_text = scene_text(options, kinematics_table(example));
      options.conditions = symmetric('x');
      const std::string half_text = scene_text(options, kinematics_table(example));
      INFO(Case{example, options}.label());
      const auto half = build(half_text);
      BodyProblem& of_half = half->problem();
      double high = 0;
      for (const std::int32_t p : of_half.body().owned()) high = std::max(high, of_half.body().position(static_cast<std::size_t>(p))[0]);
      const std::int64_t cells = std::llround(high + 0.5);
      // The whole extends as far below 0, and so does its set.
      std::string text = whole_text;
      const auto replace = [&](const std::string& from, const std::string& to) {
        const auto at = text.find(from);
        REQUIRE(at != std::string::npos);
        text.replace(at, from.size(), to);
      };
      replace("lower = [0", fmt::format("lower = [-{}", cells));
      replace("\"x < ", "\"abs(x) < ");
      const auto whole = build(text);
      BodyProblem& of_whole = whole->problem();
      REQUIRE(of_whole.body().points() == 2 * of_half.body().owned().size());
      const auto motion = [&](const Point& x) {
        const double s = x[0] < 0 ? -1 : 1, a = std::abs(x[0]);
        const double n = std::sin(7 * a + 3 * x[1] + 5 * x[2]);
        return Point{s * (0.05 * a + 0.02 * n), 0.03 * x[1] + 0.02 * std::cos(5 * a + x[1] - x[2]), 0.02 * n};
      };
      for (BodyProblem* problem : {&of_half, &of_whole}) {
        for (const std::int32_t p : problem->body().owned()) {
          const Point v = motion(problem->body().position(static_cast<std::size_t>(p)));
          for (int a = 0; a < d; ++a) problem->state().displacement().component(a)[p] = v[static_cast<std::size_t>(a)];
        }
      }
      double energy = 0, whole_energy = 0;
      const Field f = force_of(of_half, of_half.state().displacement(), &energy), g = force_of(of_whole, of_whole.state().displacement(), &whole_energy);
      if (!of_whole.terms().conservative()) continue;
      CHECK_MESSAGE(std::abs(2 * energy - whole_energy) <= 1e-12 * of_iterations(example) * whole_energy, "twice ", energy, " against ", whole_energy);
      double worst = 0;
      std::map<std::array<std::int64_t, 3>, std::int32_t> at;
      const auto cell = [](const Point& x) { return std::array<std::int64_t, 3>{std::llround(2 * x[0]), std::llround(2 * x[1]), std::llround(2 * x[2])}; };
      for (const std::int32_t p : of_whole.body().owned()) at[cell(of_whole.body().position(static_cast<std::size_t>(p)))] = p;
      for (const std::int32_t p : of_half.body().owned()) {
        const std::int32_t q = at.at(cell(of_half.body().position(static_cast<std::size_t>(p))));
        for (int a = 0; a < d; ++a) worst = std::max(worst, std::abs(f.component(a)[p] - g.component(a)[q]));
      }
      CHECK_MESSAGE(worst <= 1e-12 * of_iterations(example) * largest(of_whole.body(), g), "forces differ by ", worst / largest(of_whole.body(), g));
      PointSamples of_points{.asked = Sampling::energy}, of_whole_points{.asked = Sampling::energy};
      REQUIRE((of_half.sample(of_points).ok() && of_whole.sample(of_whole_points).ok()));
      double off = 0, most = 0;
      for (const std::int32_t p : of_half.body().owned()) {
        const double density = of_whole_points.strain_energy_density.data()[at.at(cell(of_half.body().position(static_cast<std::size_t>(p))))];
        off = std::max(off, std::abs(of_points.strain_energy_density.data()[p] - density));
        most = std::max(most, density);
      }
      CHECK_MESSAGE(off <= 1e-12 * of_iterations(example) * most, "energy densities differ by ", off / most, " of the largest");
    }
}
