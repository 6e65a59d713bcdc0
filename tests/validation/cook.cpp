/// Cook's membrane of Scabbia et al., section 4.4, nearly incompressible: the selective map does not lock.

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <chrono>
#include <cmath>

#include "core/eigen.hpp"
#include "tests/validation/quasi_static.hpp"

using namespace perikit;
using namespace perikit::validation;

namespace {

constexpr double reference_x = -5.840, reference_y = 6.941;  // of the corner (48, 60), mixed finite elements

/// Displacement of the corner (48, 60), where no point lies: the affine fit to the points within four spacings of it. (At L/120
/// radii of 2.5 to 6 spacings give errors of 0.955 to 1.002 %.)
Eigen::Vector2d corner(Simulation& simulation, double spacing) {
  BodyProblem& problem = simulation.problem();
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Matrix<double, 3, 2> right = Eigen::Matrix<double, 3, 2>::Zero();
  for (const std::int32_t p : problem.body().internal()) {
    const Point x = problem.body().position(static_cast<std::size_t>(p));
    const Eigen::Vector3d basis(1, (x[0] - 48) / spacing, (x[1] - 60) / spacing);
    if (basis.tail<2>().norm() > 4) continue;
    const FieldView u = problem.state().displacement();
    normal += basis * basis.transpose();
    right += basis * Eigen::RowVector2d(u.component(0)[p], u.component(1)[p]);
  }
  return (normal.ldlt().solve(right)).row(0).transpose();
}

/// The run at a spacing of L/parts, L = 44.
struct Membrane {
  Eigen::Vector2d corner;
  Protocol protocol;
};

Membrane run_cook(const std::string& kinematics, int parts) {
  const double spacing = 44.0 / parts;
  const auto simulation = load("scabbia/cook.toml", {fmt::format("constants.h={}", spacing), "kinematics=" + kinematics});
  const Protocol protocol = run(*simulation);
  CHECK(protocol.reports.back().time == 1.0);
  CHECK(protocol.reports.back().residual <= 1e-9);
  return {corner(*simulation, spacing), protocol};
}

}  // namespace

TEST_CASE("Cook's membrane: selective comes within 5 % on the coarsest lattice and halves that on the next, its base alone locks") {
  for (const char* base : {"bond_associated", "baqp", "projection"}) {
    INFO(base);
    double error[2];
    for (const int k : {0, 1}) {
      const Membrane found = run_cook("{ type = \"selective\", base = { type = \"" + std::string(base) + "\" } }", k == 0 ? 20 : 40);
      error[k] = std::abs(found.corner[1] / reference_y - 1);
      // As many load steps as planned: no cut-back.
      CHECK(found.protocol.reports.size() == 6);
    }
    // Against the finite elements: 4.4, 3.6 and 3.5 % are missing on the coarsest lattice. The paper's Fig. 8 has curves only.
    CHECK_MESSAGE(error[0] < (base == std::string("bond_associated") ? 0.046 : 0.039), "L/20: ", error[0]);
    CHECK_MESSAGE(error[1] < 0.6 * error[0], "L/40: ", error[1]);
  }
  const Membrane locked = run_cook("{ type = \"bond_associated\" }", 20);
  CHECK_MESSAGE(locked.corner[1] < 0.45 * reference_y, "corner ", locked.corner[1]);
}

TEST_CASE(
    "Cook's membrane: every integrator with a tangent takes the planned load steps, with no more iterations on a finer lattice") {
  struct Way {
    std::string integrator, linear;  ///< linear: what run.log counts linear iterations by
  };
  double exact = 0;
  for (const Way& way :
       {Way{"type = \"newton\"", ""}, Way{"type = \"jfnk\"", "gmres "}, Way{"type = \"kinsol\"", "iterations, "},
        Way{"type = \"kinsol\", strategy = \"none\"", "iterations, "}, Way{"type = \"kinsol\", linear_solver = \"klu\"", ""}}) {
    INFO(way.integrator);
    int iterations[2], linear[2] = {};
    for (const int k : {0, 1}) {
      const auto simulation = load("scabbia/cook.toml", {fmt::format("constants.h={}", k == 0 ? 4.4 : 2.2),
                                                         "integrator={ " + way.integrator + ", steps = 5, tolerance = 1e-9 }"});
      const Protocol protocol = run(*simulation);
      CHECK(protocol.reports.size() == 6);
      iterations[k] = protocol.iterations();
      for (std::size_t at = way.linear.empty() ? std::string::npos : protocol.text.find(way.linear); at != std::string::npos;
           at = protocol.text.find(way.linear, at + 1))
        linear[k] += std::atoi(&protocol.text[at + way.linear.size()]);
      if (k == 0) continue;
      const double rise = corner(*simulation, 2.2)[1];
      if (exact == 0) exact = rise;
      CHECK(std::abs(rise / exact - 1) < 1e-6);
    }
    MESSAGE(way.integrator, ": ", iterations[0], ", ", iterations[1], " iterations, ", linear[0], ", ", linear[1],
            " linear ones");
    CHECK(iterations[1] <= 1.1 * iterations[0] + 1);
    CHECK(iterations[1] <= 40);
    CHECK(linear[1] <= 1.3 * linear[0] + 60);  // GMRES may find out once more that a tangent is indefinite
    CHECK(linear[1] <= 200);
  }
}

// Minutes: the target validation.cook_full.
TEST_CASE("Cook's membrane, L/120: within 1 %" * doctest::skip()) {
  const auto start = std::chrono::steady_clock::now();
  const Membrane found = run_cook("{ type = \"selective\", base = { type = \"bond_associated\" } }", 120);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  MESSAGE("corner ", found.corner[0], ", ", found.corner[1], " in ", seconds, " s, ", found.protocol.reports.size() - 1,
          " load steps");
  CHECK(std::abs(found.corner[0] / reference_x - 1) < 0.05);
  CHECK(std::abs(found.corner[1] / reference_y - 1) < 0.01);
}
