/// Point gradients of order 1 to 8: exact for polynomials up to their degree, on whole families of a lattice and on random ones.

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <random>

#include "families/family_arrays.hpp"

using namespace perikit;

namespace {

using Xi = std::array<double, 3>;

double constant(double) {
  return 1;
}
double cone(double share) {
  return 1.1 - share;
}

/// Unit volumes, influence of |xi|/horizon.
FamilyArrays family_of(int dimension, double horizon, const std::vector<Xi>& bonds, double (*influence)(double)) {
  FamilyArrays family;
  family.resize(dimension, static_cast<int>(bonds.size()));
  for (std::size_t k = 0; k < bonds.size(); ++k) {
    for (std::size_t c = 0; c < static_cast<std::size_t>(dimension); ++c) family.xi[c][k] = bonds[k][c];
    family.length[k] = std::hypot(bonds[k][0], bonds[k][1], bonds[k][2]);
    family.volume[k] = 1;
    family.omega[k] = influence(family.length[k] / horizon);
  }
  return family;
}

/// Bonds of a point of a lattice of spacing 1; half: those with x >= 0 only.
std::vector<Xi> lattice_bonds(int dimension, double horizon, bool half = false) {
  const int m = static_cast<int>(horizon);
  std::vector<Xi> bonds;
  for (int a = half ? 0 : -m; a <= m; ++a)
    for (int b = dimension > 1 ? -m : 0; b <= (dimension > 1 ? m : 0); ++b)
      for (int c = dimension > 2 ? -m : 0; c <= (dimension > 2 ? m : 0); ++c) {
        const double length = std::sqrt(a * a + b * b + c * c);
        if (length > 0 && length <= horizon) bonds.push_back({double(a), double(b), double(c)});
      }
  return bonds;
}

/// Largest error of the gradient of ((e . xi + s)/horizon)^n, over the largest |n (s/horizon)^(n-1)|: such powers span the
/// polynomials of degree n.
double error(const FamilyArrays& family, double horizon, int degree, const std::vector<double>& g) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-1, 1);
  double worst = 0;
  const auto d = static_cast<std::size_t>(family.dimension);
  for (int trial = 0; trial < 20; ++trial) {
    Xi e{};
    for (std::size_t c = 0; c < d; ++c) e[c] = uniform(random);
    const double at = horizon * (0.5 + 0.5 * std::abs(uniform(random)));
    const auto value = [&](double x) { return std::pow((x + at) / horizon, degree); };
    Xi gradient{};
    for (std::size_t k = 0; k < static_cast<std::size_t>(family.bonds); ++k) {
      double along = 0;
      for (std::size_t c = 0; c < d; ++c) along += e[c] * family.xi[c][k];
      for (std::size_t c = 0; c < d; ++c) gradient[c] += g[k * d + c] * (value(along) - value(0));
    }
    const double slope = degree * std::pow(at / horizon, degree - 1);
    for (std::size_t c = 0; c < d; ++c) worst = std::max(worst, std::abs(gradient[c] * horizon / slope - e[c]));
  }
  return worst;
}

}  // namespace

TEST_CASE("gradients of order 1 to 8 are exact for polynomials up to their degree, and for none above") {
  double most = 0;
  for (int d = 1; d <= 3; ++d)
    for (const auto influence : {constant, cone})
      for (int order = 2; order <= 8; ++order) {
        INFO(d, "D, order ", order);
        const FamilyArrays family = family_of(d, 5.015, lattice_bonds(d, 5.015), influence);
        std::vector<double> g;
        REQUIRE(point_gradient(family, 5.015, order, g) == order);
        for (int degree = 1; degree <= order; ++degree) {
          const double off = error(family, 5.015, degree, g);
          most = std::max(most, off);
          CHECK_MESSAGE(off <= 2e-12, "degree ", degree, " is off by ", off);
        }
        // Symmetric families see even powers exactly at every order: the next odd one is what they miss.
        CHECK(error(family, 5.015, order % 2 == 0 ? order + 1 : order + 2, g) > 1e-4);
      }
  MESSAGE("off by at most ", most);
}

TEST_CASE("gradients of order 8 on random points, without any symmetry") {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> noise(-0.25, 0.25);
  for (int d = 1; d <= 3; ++d) {
    std::vector<Xi> bonds = lattice_bonds(d, 6.015);
    for (Xi& xi : bonds)
      for (std::size_t c = 0; c < static_cast<std::size_t>(d); ++c) xi[c] += noise(random);
    const FamilyArrays family = family_of(d, 6.5, bonds, constant);
    std::vector<double> g;
    const int order = d == 3 ? 7 : 8;  // in 3D the moment matrix of these points is at the limit for 8
    REQUIRE(point_gradient(family, 6.5, order, g) == order);
    CHECK_MESSAGE(error(family, 6.5, order, g) <= 1e-10, d, "D");
    CHECK_MESSAGE(error(family, 6.5, order + 1, g) > 1e-4, d, "D");
  }
}

TEST_CASE("families with too few bonds for an order take the highest that they support") {
  struct Row {
    int dimension;
    double horizon;
    bool half;
    int highest;
  };
  // 8, 44 and 164 monomials of degree 1 to 8. On a line 2 m bonds support order 2 m. A family of two spacings in the plane has 12
  // bonds, as many as degree 3 has monomials and two to spare, but only five places along an axis. At a face half of the family
  // is left.
  for (const Row row : {Row{1, 4.015, false, 8}, Row{1, 3.015, false, 6}, Row{1, 1.015, false, 2}, Row{1, 5.015, true, 5},
                        Row{2, 3.015, false, 5}, Row{2, 5.015, false, 8}, Row{2, 1.015, false, 1}, Row{3, 5.015, false, 8},
                        Row{3, 3.015, false, 5}}) {
    const FamilyArrays family =
        family_of(row.dimension, row.horizon, lattice_bonds(row.dimension, row.horizon, row.half), constant);
    std::vector<double> g;
    CHECK_MESSAGE(point_gradient(family, row.horizon, 8, g) == row.highest, row.dimension, "D, horizon ", row.horizon);
    if (row.highest == 8) continue;
    CHECK(error(family, row.horizon, row.highest, g) <= 1e-10);
  }
}
