/// Bodies of few points across: gradients of order 2 with a penalty on what the whole fit leaves and the second moments of cells carry every
/// quadratic displacement with its energy, uniform bending among them.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <functional>

#include "tests/validation/quasi_static.hpp"
#include "tests/validation/scenes.hpp"

using namespace perikit;
using namespace perikit::validation;

namespace {

constexpr double youngs_modulus = 2.0, poisson_ratio = 0.3;

const std::vector<std::string> penalties{"", "stabilization = \"silling\"", "stabilization = \"wan\""};

/// A box from the origin, of so many points of spacing h along each axis; `kinematics`: keys of conventional. sections: more of the scene.
std::string box(const std::vector<int>& points, double h, double ratio, const std::string& kinematics, const std::string& sections = "[integrator]\ntype = \"evaluate\"\n") {
  std::string lower, upper;
  for (const int n : points) {
    lower += "0,";
    upper += fmt::format("{:.17g},", n * h);
  }
  const char* const plane = points.size() == 2 ? "plane = \"stress\"\nthickness = 1\n" : "";
  return fmt::format(
      "format = 1\n[body]\ndimension = {}\n{}[body.lattice]\nspacing = {:.17g}\nlower = [{}]\nupper = [{}]\n[family]\nhorizon_ratio = {}\ninfluence = \"constant\"\n"
      "[kinematics]\ntype = \"conventional\"\norder = 2\n{}\n[material]\ntype = \"linear_elastic\"\nyoungs_modulus = {}\npoisson_ratio = {}\n{}",
      points.size(), plane, h, lower, upper, ratio, kinematics, youngs_modulus, poisson_ratio, sections);
}

/// A field of displacements of degree 2: u_c = sum_m a_cm x^m over the monomials x^m of degree 1 and 2.
struct Quadratic {
  int d;
  double linear[3][3], second[3][3][3];   ///< second: symmetric in its last two

  Quadratic(int dimension, unsigned seed) : d(dimension) {
    contract::Noise noise(seed);
    for (int c = 0; c < 3; ++c)
      for (int a = 0; a < 3; ++a) {
        linear[c][a] = c < d && a < d ? 1e-3 * noise() : 0.0;
        for (int b = a; b < 3; ++b) second[c][a][b] = second[c][b][a] = c < d && b < d ? 1e-3 * noise() : 0.0;
      }
  }
  Point at(const Point& x) const {
    Point u{};
    for (int c = 0; c < d; ++c)
      for (int a = 0; a < d; ++a) {
        u[static_cast<std::size_t>(c)] += linear[c][a] * x[static_cast<std::size_t>(a)];
        for (int b = 0; b < d; ++b) u[static_cast<std::size_t>(c)] += 0.5 * second[c][a][b] * x[static_cast<std::size_t>(a)] * x[static_cast<std::size_t>(b)];
      }
    return u;
  }
  /// sym(grad u).
  std::array<std::array<double, 3>, 3> strain(const Point& x) const {
    double H[3][3] = {};
    for (int c = 0; c < d; ++c)
      for (int a = 0; a < d; ++a) {
        H[c][a] = linear[c][a];
        for (int b = 0; b < d; ++b) H[c][a] += second[c][a][b] * x[static_cast<std::size_t>(b)];
      }
    std::array<std::array<double, 3>, 3> e{};
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t a = 0; a < 3; ++a) e[c][a] = 0.5 * (H[c][a] + H[a][c]);
    return e;
  }
};

/// lambda of the material in the space of the body, plane stress in two dimensions.
double lame_lambda(int d) {
  return d == 2 ? youngs_modulus * poisson_ratio / (1 - poisson_ratio * poisson_ratio) : youngs_modulus * poisson_ratio / ((1 + poisson_ratio) * (1 - 2 * poisson_ratio));
}
double shear_modulus() { return youngs_modulus / (2 * (1 + poisson_ratio)); }

/// The work that the stress of u does on the strain of w in a box, by Gauss's rule of two points an axis, which is exact of cubic densities.
double work(const Quadratic& u, const Quadratic& w, const std::vector<double>& size) {
  const int d = u.d;
  double sum = 0, volume = 1;
  for (const double length : size) volume *= length;
  for (int corner = 0; corner < 1 << d; ++corner) {
    Point x{};
    for (int a = 0; a < d; ++a)
      x[static_cast<std::size_t>(a)] = size[static_cast<std::size_t>(a)] * (0.5 + (corner >> a & 1 ? 0.5 : -0.5) / std::sqrt(3.0));
    const auto e = u.strain(x), f = w.strain(x);
    double double_dot = 0, trace_e = 0, trace_f = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      trace_e += e[a][a];
      trace_f += f[a][a];
      for (std::size_t b = 0; b < 3; ++b) double_dot += e[a][b] * f[a][b];
    }
    sum += lame_lambda(d) * trace_e * trace_f + 2 * shear_modulus() * double_dot;
  }
  return volume * sum / (1 << d);
}

}  // namespace

TEST_CASE("thin bodies: every quadratic displacement does the work of its stress on every other, in boxes of any size") {
  struct Body {
    std::vector<int> points;
    double ratio;
  };
  for (const Body& body : {Body{{9, 3}, 2.015}, Body{{12, 7}, 3.015}, Body{{8, 3, 4}, 2.015}})
    for (const std::string& penalty : penalties) {
      INFO(body.points.size(), "D, ", penalty);
      constexpr double h = 0.25;
      const auto simulation = build(box(body.points, h, body.ratio, penalty));
      BodyProblem& problem = simulation->problem();
      const int d = problem.dimension();
      std::vector<double> size;
      for (const int n : body.points) size.push_back(n * h);
      const Quadratic u(d, 5), w(d, 6);
      Field other = problem.body().make_field(d);
      contract::set_field(problem.body(), problem.state().displacement(), [&](const Point& x) { return u.at(x); });
      contract::set_field(problem.body(), other, [&](const Point& x) { return w.at(x); });
      double energy = 0;
      const Field force = contract::force_of(problem, problem.state().displacement(), &energy);
      const double exact = work(u, u, size) / 2, mutual = work(u, w, size);
      CHECK_MESSAGE(std::abs(energy - exact) <= 1e-10 * exact, "energy over the exact one: ", energy / exact);
      CHECK_MESSAGE(std::abs(-contract::dot(problem.body(), force, other) - mutual) <= 1e-10 * exact, "work over the exact one: ", -contract::dot(problem.body(), force, other) / mutual);
      // Without the moments of cells, or with a penalty on what the linear part of the fit leaves, it is not.
      if (body.points.size() == 3) continue;
      for (const std::string& less : {std::string("cell_moments = false"), std::string("stabilization = { type = \"silling\", fit = \"linear\" }")}) {
        const auto lesser = build(box(body.points, h, body.ratio, less));
        CHECK(std::abs(contract::energy_of(lesser->problem(), problem.state().displacement()) - exact) > 1e-3 * exact);
      }
    }
}

TEST_CASE("thin bodies: cells of a cloud have no moments that are known: none by themselves, and none on demand") {
  const auto jittered = [](const std::string& kinematics) {
    std::string text = box({8, 8}, 0.25, 2.515, kinematics);
    text.insert(text.find("[family]"), "jitter = 0.1\n");
    return build(text);
  };
  CHECK(jittered("")->problem().report().evaluation_points == 64);
  CHECK_THROWS_WITH_AS(jittered("cell_moments = true"), doctest::Contains("kinematics.cell_moments: found true on points that are no lattice"), InputError);
  CHECK(build(box({8, 8}, 0.25, 2.515, ""))->problem().report().evaluation_points == 4 * 64);
}

TEST_CASE("thin bodies: uniform bending of a strip has its moment and is in equilibrium, of three points across and more") {
  for (const double ratio : {2.015, 3.015})
    for (const int n : {3, 4, 6, 12})
      for (const std::string& penalty : penalties) {
        INFO("m = ", ratio, ", ", n, " points across, ", penalty);
        const double h = 1.0 / n, length = 6;
        const auto simulation = build(box({6 * n, n}, h, ratio, penalty));
        BodyProblem& problem = simulation->problem();
        constexpr double curvature = 1e-3;
        contract::set_field(problem.body(), problem.state().displacement(), [&](const Point& x) {
          const double y = x[1] - 0.5;
          return Point{curvature * (x[0] - length / 2) * y, -curvature * ((x[0] - length / 2) * (x[0] - length / 2) + poisson_ratio * y * y) / 2, 0};
        });
        double energy = 0;
        const Field force = contract::force_of(problem, problem.state().displacement(), &energy);
        const double exact = youngs_modulus / 12 * curvature * curvature / 2 * length;
        CHECK_MESSAGE(std::abs(energy - exact) <= 1e-10 * exact, "moment over the exact one: ", energy / exact);
        double worst = 0;
        for (const std::int32_t p : problem.body().internal()) {
          const Point x = problem.body().position(static_cast<std::size_t>(p));
          for (int c = 0; c < 2 && std::abs(x[0] - length / 2) < length / 2 - 2 * ratio * h; ++c) worst = std::max(worst, std::abs(force.component(c)[p]));
        }
        CHECK(worst <= 1e-12 * youngs_modulus * curvature);
      }
}

TEST_CASE("thin bodies: half of a bent strip beside a plane of symmetry has half of its energy, and is in equilibrium there") {
  for (const int n : {3, 6}) {
    constexpr double ratio = 2.015, curvature = 1e-3, length = 3;
    const double h = 1.0 / n;
    const auto simulation = build(box({3 * n, n}, h, ratio, "stabilization = \"silling\"", "[[symmetry]]\naxis = \"x\"\nat = 0\n[integrator]\ntype = \"evaluate\"\n"));
    BodyProblem& problem = simulation->problem();
    const FieldView u = problem.state().displacement();
    for (const std::int32_t p : problem.body().owned()) {   // images follow
      const Point x = problem.body().position(static_cast<std::size_t>(p));
      const double y = x[1] - 0.5;
      u.component(0)[p] = curvature * x[0] * y;
      u.component(1)[p] = -curvature * (x[0] * x[0] + poisson_ratio * y * y) / 2;
    }
    double energy = 0, worst = 0;
    const Field force = contract::force_of(problem, u, &energy);
    const double exact = youngs_modulus / 12 * curvature * curvature / 2 * length;
    CHECK_MESSAGE(std::abs(energy - exact) <= 1e-10 * exact, "energy over the exact one: ", energy / exact);
    for (const std::int32_t p : problem.body().owned())
      for (int c = 0; c < 2 && problem.body().position(static_cast<std::size_t>(p))[0] < length - 2 * ratio * h; ++c) worst = std::max(worst, std::abs(force.component(c)[p]));
    CHECK(worst <= 1e-12 * youngs_modulus * curvature);
  }
}

TEST_CASE("thin bodies: the force at the end of a cantilever of three points across and more") {
  // Timoshenko and Goodier's cantilever in layers at both ends, of which the right one is pulled by P in the exact solution.
  const std::array<std::pair<int, double>, 4> bounds{std::pair{3, 0.02}, {4, 0.02}, {6, 0.015}, {12, 0.005}};
  for (const double ratio : {2.015, 3.015})
    for (const std::pair<int, double>& body : bounds) {
      const int n = body.first;
      const double bound = body.second;
      constexpr double length = 8, P = 1e-3;
      const double h = 1.0 / n, layer = std::min(2 * ratio * h, 2.2);
      const std::string y = "(y - 0.5)", by = fmt::format("{:.17g}", P / (6 * youngs_modulus / 12)), nu = fmt::format("{}", poisson_ratio);
      const std::string field = fmt::format("[\"{0}*{1}*((48 - 3*x)*x + (2 + {2})*({1}*{1} - 0.25))\", \"-{0}*(3*{2}*{1}*{1}*(8 - x) + (4 + 5*{2})*x/4 + (24 - x)*x*x)\"]", by, y, nu);
      const std::string sections = fmt::format(
          "[sets]\nleft = \"x < {0:.17g}\"\nright = \"x > {1:.17g}\"\n[[boundary]]\nset = \"left\"\ndisplacement = {2}\n[[boundary]]\nset = \"right\"\ndisplacement = {2}\n"
          "[integrator]\ntype = \"newton\"\n",
          layer, length - layer, field);
      const auto simulation = build(box({8 * n, n}, h, ratio, "stabilization = \"silling\"", sections));
      run(*simulation);
      const double force = -pull(*simulation, "right", 1) / P;
      CHECK_MESSAGE(std::abs(force - 1) <= bound, "m = ", ratio, ", ", n, " points across: force over the exact one ", force);
    }
}
