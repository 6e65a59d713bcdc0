/// What a crack takes by `critical_energy`, summed up without a run: the limits of all bonds that cross a unit of area of a plane, over Gc. On lattices
/// it is 1 for planes along the lattice, whatever the influence function and its factor; elsewhere within the bounds of framework/docs/fracture.md.

#include "fracture/limits/crossing_bonds.hpp"

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <fstream>
#include <numbers>
#include <random>

#include "fracture/search/bond_energy_split.hpp"
#include "scene/scene.hpp"
#include "tests/kit/registry.hpp"

using namespace perikit;
using namespace perikit::test;

namespace {

struct Kernel {
  std::string name, type, table;
};
const std::vector<Kernel> kernels{{"constant", "constant", ""},
                                  {"inverse", "inverse", ""},
                                  {"cone", "cone", ""},
                                  {"gaussian", "gaussian", ""},
                                  {"cubic_spline", "cubic_spline", ""},
                                  {"exp(-9 r^2)", "expression", "formula = \"exp(-9*r^2)\""},
                                  {"5 exp(-9 r^2)", "expression", "formula = \"5*exp(-9*r^2)\""}};

std::shared_ptr<const InfluenceFunction> influence(const Kernel& kernel) { return all_parts().influence(*parse_part(Kind::influence, kernel.type, kernel.table, all_parts())); }

Formulation formulation(const std::string& kinematics) { return make_formulation(all_parts().kinematics(*parse_part(Kind::kinematics, kinematics, "", all_parts()))); }

FamilyNeeds needs(const Formulation& f) { return {.influence = !f.pairs || f.pair_traits.influence, .shapes = !f.pairs}; }

BodyFrame frame(int dimension, double m) {
  BodyFrame frame;
  frame.space = dimension == 1 ? Space::line_strain : dimension == 2 ? Space::plane_strain : Space::solid;
  frame.spacing = 1;
  frame.horizon = m + 0.015;
  return frame;
}

/// A body whose middle point has a whole family.
Body lattice(int dimension, int m) {
  const int n = 2 * m + 1;
  const Lattice grid = make_lattice(dimension, 1.0, {}, {double(n), dimension > 1 ? double(n) : 0, dimension > 2 ? double(n) : 0}, m + 0.015);
  std::vector<std::int32_t> cells;
  for (int z = 0; z < (dimension > 2 ? n : 1); ++z)
    for (int y = 0; y < (dimension > 1 ? n : 1); ++y)
      for (int x = 0; x < n; ++x) {
        const std::array<std::int64_t, 3> input{x, y, z};
        const auto inner = [&](std::size_t k) { return input[static_cast<std::size_t>(grid.axis[k])]; };
        cells.push_back(static_cast<std::int32_t>(grid.index(inner(0), inner(1), inner(2))));
      }
  return Body(frame(dimension, m), grid, cells);
}

/// A cloud: points of a lattice that is turned about z, each moved by up to `jitter` spacings along every axis.
Body cloud(int dimension, int m, double degrees, double jitter) {
  const double width = 2 * m + (dimension == 1 ? 200 : dimension == 2 ? 10 : 4), turn = degrees * std::numbers::pi / 180;
  const int n = static_cast<int>(width);
  std::mt19937_64 engine(7);
  const auto moved = [&] { return jitter * (2 * (static_cast<double>(engine() >> 11) * 0x1.0p-53) - 1); };
  std::vector<Point> points;
  for (int z = 0; z < (dimension > 2 ? n : 1); ++z)
    for (int j = dimension > 1 ? -n : 0; j < (dimension > 1 ? n : 1); ++j)
      for (int i = -n; i < n; ++i) {
        const double a = i + 0.5, b = dimension > 1 ? j + 0.5 : 0.0;
        Point x{std::cos(turn) * a - std::sin(turn) * b + moved(), dimension > 1 ? std::sin(turn) * a + std::cos(turn) * b + moved() : 0.0, dimension > 2 ? z + 0.5 + moved() : 0.0};
        if (std::abs(x[0]) < width / 2 && std::abs(x[1]) < width / 2) points.push_back(x);
      }
  const std::vector<double> volumes(points.size(), 1.0);
  return Body(frame(dimension, m), points, volumes);
}

struct OverGc {
  double shared = 0, equal = 0;
};

/// Limits of the bonds that cross a unit of area of the planes with this normal, on the mean over their places, over Gc.
OverGc over_gc(const Families& families, const Formulation& f, const Point& normal) {
  const Body& body = families.body();
  const int d = body.dimension();
  const CrossingBonds crossing = crossing_bonds(families, f);
  OverGc sum;
  double volumes = 0;
  FamilyArrays family;
  AlignedVector<double> share;
  Point lower{1e9, 1e9, 1e9}, upper{-1e9, -1e9, -1e9};
  for (const std::int32_t index : body.internal())
    for (std::size_t a = 0; a < 3; ++a) {
      const double x = body.position(static_cast<std::size_t>(index))[a];
      lower[a] = std::min(lower[a], x);
      upper[a] = std::max(upper[a], x);
    }
  for (const std::int32_t index : body.internal()) {
    const Point x = body.position(static_cast<std::size_t>(index));
    bool inside = true;   // its family is whole
    for (std::size_t a = 0; a < static_cast<std::size_t>(d); ++a) inside = inside && std::min(x[a] - lower[a], upper[a] - x[a]) > body.horizon() - 0.1;
    if (!inside) continue;
    families.load(static_cast<std::size_t>(index), BondsOf::uncut, family);
    energy_shares(f, d, family, share);
    volumes += 1;
    for (std::size_t k = 0; k < family.far.size(); ++k) {
      double across = 0;
      for (int c = 0; c < d; ++c) across += family.xi[c][k] * normal[static_cast<std::size_t>(c)];
      if (across <= 0) continue;
      sum.shared += share[k] * family.volume[k] * across / crossing.shares;
      sum.equal += family.volume[k] * across / crossing.plain;
    }
  }
  return {sum.shared / volumes, sum.equal / volumes};
}

Point along(double degrees) { return {std::cos(degrees * std::numbers::pi / 180), std::sin(degrees * std::numbers::pi / 180), 0}; }

std::unique_ptr<Families> families_of(const Body& body, const Kernel& kernel, const Formulation& f) {
  auto families = Families::make(body, influence(kernel), needs(f));
  families->let_fail();
  return families;
}

}  // namespace

TEST_CASE("critical_energy: planes along a lattice take Gc, with every kernel and factor, horizon and dimension") {
  for (const char* const kinematics : {"baqp", "conventional", "bond_associated", "ordinary", "bond_based"}) {
    const Formulation f = formulation(kinematics);
    for (int d = 1; d <= 3; ++d)
      for (int m = 2; m <= (d == 3 ? 3 : 6); ++m) {
        const Body body = lattice(d, m);
        for (const Kernel& kernel : kernels) {
          INFO(fmt::format("{}, {}D, horizon {}, {}", kinematics, d, m, kernel.name));
          const auto families = families_of(body, kernel, f);
          for (int axis = 0; axis < d; ++axis) {
            Point normal{};
            normal[static_cast<std::size_t>(axis)] = 1;
            const OverGc ratio = over_gc(*families, f, normal);
            CHECK(ratio.shared == doctest::Approx(1).epsilon(1e-12));
            CHECK(ratio.equal == doctest::Approx(1).epsilon(1e-12));
          }
        }
      }
  }
}

TEST_CASE("critical_energy: planes across a lattice take as much but for its directions") {
  const Formulation f = formulation("baqp");
  for (int m = 2; m <= 6; ++m) {
    const Body body = lattice(2, m);
    for (const Kernel& kernel : kernels)
      for (const double degrees : {22.5, 45.0}) {
        INFO(fmt::format("horizon {}, {}, {} degrees", m, kernel.name, degrees));
        const OverGc ratio = over_gc(*families_of(body, kernel, f), f, along(degrees));
        CHECK(ratio.shared > 0.99);
        CHECK(ratio.shared < (m == 2 ? 1.3 : m == 3 ? 1.15 : 1.1));
      }
  }
}

TEST_CASE("critical_energy: clouds, jittered or lattices that are turned, take Gc within 10 %") {
  for (const char* const kinematics : {"baqp", "ordinary"}) {
    const Formulation f = formulation(kinematics);
    for (int d = 1; d <= 3; ++d)
      for (int m = 2; m <= (d == 3 ? 3 : 6); ++m)
        for (const auto& turned : {std::pair(0.0, 0.2), std::pair(22.5, 0.0), std::pair(45.0, 0.0)}) {
          const double degrees = turned.first, jitter = turned.second;
          if (d == 1 && degrees > 0) continue;
          const Body body = cloud(d, m, degrees, jitter);
          for (const Kernel& kernel : kernels) {
            INFO(fmt::format("{}, {}D, horizon {}, {}, turned by {}, jitter {}", kinematics, d, m, kernel.name, degrees, jitter));
            const OverGc ratio = over_gc(*families_of(body, kernel, f), f, along(0));
            CHECK(std::abs(ratio.shared - 1) < 0.1);
          }
        }
  }
}

TEST_CASE("critical_energy: a factor of the influence function changes no limit") {
  const Formulation f = formulation("baqp");
  for (const bool on_lattice : {true, false}) {
    const Body body = on_lattice ? lattice(2, 3) : cloud(2, 3, 0, 0.2);
    const auto one = families_of(body, kernels[5], f), five = families_of(body, kernels[6], f);
    CHECK(crossing_bonds(*one, f).shares == doctest::Approx(crossing_bonds(*five, f).shares).epsilon(1e-14));
    FamilyArrays a, b;
    for (const std::int32_t p : body.internal()) {
      one->load(static_cast<std::size_t>(p), BondsOf::uncut, a);
      five->load(static_cast<std::size_t>(p), BondsOf::uncut, b);
      for (std::size_t k = 0; k < a.far.size(); ++k) CHECK(a.omega[k] == doctest::Approx(b.omega[k]).epsilon(1e-14));
    }
  }
}

/// The figures of framework/docs/fracture.md, "Influence functions and the lattice", into crossing_bonds.md.
TEST_CASE("table of G over Gc by kernel, horizon and direction" * doctest::skip()) {
  const Formulation f = formulation("baqp");
  std::ofstream out("crossing_bonds.md");
  out << "| dimension, kernel | horizon | lattice, 22.5 degrees | 45 degrees | cloud turned by 0 | 22.5 | 45 | jitter 0.2 |\n|---|---|---|---|---|---|---|---|\n";
  for (int d = 2; d <= 3; ++d)
    for (const Kernel& kernel : kernels) {
      if (kernel.name.starts_with('5')) continue;
      for (int m = 2; m <= (d == 3 ? 4 : 6); ++m) {
        const Body body = lattice(d, m);
        const auto families = families_of(body, kernel, f);
        out << fmt::format("| {}D, `{}` | {} | {:.3f} | {:.3f} |", d, kernel.name, m, over_gc(*families, f, along(22.5)).shared, over_gc(*families, f, along(45)).shared);
        for (const auto& [degrees, jitter] : {std::pair(0.0, 0.0), std::pair(22.5, 0.0), std::pair(45.0, 0.0), std::pair(0.0, 0.2)}) {
          const Body points = cloud(d, m, degrees, jitter);
          out << fmt::format(" {:.3f} |", over_gc(*families_of(points, kernel, f), f, along(0)).shared);
        }
        out << '\n';
      }
    }
}
