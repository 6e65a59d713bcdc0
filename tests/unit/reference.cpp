/// The dense reference against what must hold for it: identities of the stencils, derivatives by differences, special cases, and
/// the checkerboard energies.
#include "framework/reference/reference.hpp"

#include <doctest/doctest.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>
#include <random>

#include "tests/kit/derivative.hpp"

using namespace perikit::reference;
using perikit::test::slope_of;

namespace {

double constant(double) {
  return 1;
}
double gaussian(double r) {
  return std::exp(-r * r);
}
double cubic_spline(double r) {
  return r <= 0.5 ? 1 - 6 * r * r + 6 * r * r * r : r <= 1 ? 2 * std::pow(1 - r, 3) : 0;
}

/// Saint Venant-Kirchhoff: S = lambda tr(E) I + 2 mu E.
Law saint_venant_kirchhoff(double lambda, double mu) {
  const auto second_piola = [=](const Tensor& E) -> Tensor { return lambda * E.trace() * Tensor::Identity() + 2 * mu * E; };
  const auto strain = [](const Tensor& H) -> Tensor { return (H + H.transpose() + H.transpose() * H) / 2; };
  const auto P = [=](const Tensor& H) -> Tensor { return (Tensor::Identity() + H) * second_piola(strain(H)); };
  return {[=](const Tensor& H) { return strain(H).cwiseProduct(second_piola(strain(H))).sum() / 2; }, P,
          [=](const Tensor& H) {
            const Tensor F = Tensor::Identity() + H, S = second_piola(strain(H));
            Matrix A(9, 9);
            for (int c = 0; c < 9; ++c) {
              Tensor dF = Tensor::Zero();
              dF(c / 3, c % 3) = 1;
              const Tensor dP = dF * S + F * second_piola((F.transpose() * dF + dF.transpose() * F) / 2);
              for (int r = 0; r < 9; ++r) A(r, c) = dP(r / 3, r % 3);
            }
            return A;
          }};
}

constexpr double spacing = 0.1;

double relative(double a, double b) {
  return std::abs(a - b) / std::abs(b);
}

/// A cubic grid of side `side`, jittered by up to `jitter` spacings, with volumes that vary by as much.
Cloud grid(int d, int side, double ratio, double jitter, double (*influence)(double), unsigned seed = 7) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> offset(-jitter, jitter);
  Cloud cloud;
  cloud.dimension = d;
  cloud.horizon = ratio * spacing;
  cloud.influence = influence;
  for (int p = 0; p < std::pow(side, d); ++p) {
    Vector x(d);
    for (int c = 0, rest = p; c < d; ++c, rest /= side) x[c] = spacing * (rest % side + offset(random));
    cloud.position.push_back(x);
    cloud.volume.push_back(std::pow(spacing, d) * (1 + offset(random)));
  }
  return cloud;
}

Cloud jittered(int d) {
  return d == 1 ? grid(1, 12, 3.015, 0.2, gaussian) : d == 2 ? grid(2, 6, 2.015, 0.2, gaussian) : grid(3, 4, 1.8, 0.2, gaussian);
}

/// A smooth field of a few per cent strain plus noise; small enough for the near-singular quadrants of jittered surfaces, which
/// magnify it.
Vector displacement(const Cloud& cloud, double noise = 1e-3) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> offset(-noise * spacing, noise * spacing);
  const int d = cloud.dimension;
  Vector u(d * cloud.points());
  for (int i = 0; i < cloud.points(); ++i)
    for (int c = 0; c < d; ++c) u[d * i + c] = 0.02 * std::sin(2 * cloud.position[i].sum() + c) + offset(random);
  return u;
}

Vector affine(const Cloud& cloud, const Matrix& H) {
  const int d = cloud.dimension;
  Vector u(d * cloud.points());
  for (int i = 0; i < cloud.points(); ++i) u.segment(d * i, d) = H * cloud.position[i] + Vector::Constant(d, 0.3);
  return u;
}

std::vector<Description> all_kinematics() {
  std::vector<Description> all{{.name = "conventional"},
                               {.name = "conventional", .order = 2},
                               {.name = "sub_horizon"},
                               {.name = "sub_horizon", .part_volumes = true},
                               {.name = "bond_associated"},
                               {.name = "bond_associated", .bond_horizon_ratio = 0.8},
                               {.name = "baqp"},
                               {.name = "baqp", .order = 2},
                               {.name = "projection"},
                               {.name = "projection", .weight = Weight::kernel},
                               {.name = "bond_augmented"},
                               {.name = "non_spherical", .n1 = 2, .n2 = 3}};
  for (const char* base : {"bond_associated", "baqp", "projection", "sub_horizon", "bond_augmented", "non_spherical"})
    all.push_back({.name = "selective", .base = std::make_shared<Description>(Description{.name = base})});
  return all;
}

std::string label(const Description& k) {
  return k.name + (k.base ? "/" + k.base->name : "") + " order " + std::to_string(k.order);
}

/// Sum of forces and sum of moments (all component pairs) about the origin in the deformed body.
std::pair<Vector, Matrix> resultants(const Cloud& cloud, const Vector& u, const Vector& f) {
  const int d = cloud.dimension;
  Vector force = Vector::Zero(d);
  Matrix moment = Matrix::Zero(d, d);
  for (int i = 0; i < cloud.points(); ++i) {
    const Vector y = cloud.position[i] + u.segment(d * i, d), f_i = f.segment(d * i, d);
    force += f_i;
    moment += y * f_i.transpose() - f_i * y.transpose();
  }
  return {force, moment};
}

/// Largest difference (Euclidean) of the stencils of two operators, times the spacing.
double difference(const Operator& a, const Operator& b) {
  REQUIRE(a.q.size() == b.q.size());
  double largest = 0;
  for (std::size_t q = 0; q < a.q.size(); ++q) {
    Matrix g = Matrix::Zero(a.points, a.dimension);
    for (const auto& [k, g_k] : a.q[q].stencil) g.row(k) += g_k;
    for (const auto& [k, g_k] : b.q[q].stencil) g.row(k) -= g_k;
    largest = std::max({largest, spacing * g.norm(), std::abs(a.q[q].weight / b.q[q].weight - 1)});
  }
  return largest;
}

constexpr double lambda = 1.3, mu = 0.8;
const Law law = saint_venant_kirchhoff(lambda, mu);

}  // namespace

TEST_CASE("reference: stencils are exact for affine motion and their weights add up to the volumes") {
  for (int d = 1; d <= 3; ++d)
    for (const Description& kinematics : all_kinematics()) {
      CAPTURE(d);
      CAPTURE(label(kinematics));
      const Cloud cloud = jittered(d);
      const Operator op = build(cloud, kinematics);
      Matrix H = 0.1 * Matrix::Random(d, d);
      const Vector u = affine(cloud, H);
      std::vector<double> weight(cloud.points());
      double affine_error = 0, sum_error = 0;
      for (const EvaluationPoint& q : op.q) {
        weight[q.owner] += q.weight;
        Vector sum = Vector::Zero(d);
        for (const auto& [k, g] : q.stencil) sum += g;
        sum_error = std::max(sum_error, spacing * sum.norm());
        affine_error = std::max(affine_error, (gradient(q.stencil, d, u).topLeftCorner(d, d) - H).norm());
      }
      CHECK(sum_error < 1e-12);
      CHECK(affine_error < 1e-10);
      for (int i = 0; i < cloud.points(); ++i) CHECK(relative(weight[i], cloud.volume[i]) < 1e-12);
    }
}

TEST_CASE("reference: force and tangent are derivatives, momenta are conserved, with and without broken bonds") {
  for (int d = 1; d <= 3; ++d)
    for (const bool broken : {false, true})
      for (const Description& kinematics : all_kinematics()) {
        CAPTURE(d);
        CAPTURE(broken);
        CAPTURE(label(kinematics));
        Cloud cloud = jittered(d);
        if (broken) cloud.integrity = [](int i, int j) { return (i + j) % 7 == 0 ? 0.0 : i * j % 5 == 1 ? 0.4 : 1.0; };
        const Operator op = build(cloud, kinematics);
        const Vector u = displacement(cloud), v = displacement(cloud, 0.5) - 2 * u;
        const Vector f = force(op, law, u);
        const double step = kinematics.name == "selective" ? 3e-5 : 1e-3;  // the map is no polynomial
        const double by_difference = -slope_of([&](double t) { return energy(op, law, u + t * v); }, step);
        CHECK(std::abs(f.dot(v) - by_difference) < 1e-8 * f.norm() * v.norm());
        const auto [total, moment] = resultants(cloud, u, f);
        CHECK(total.norm() < 1e-12 * f.norm());
        CHECK(moment.norm() < 1e-12 * f.norm());
        if (d < 3) {
          const Matrix K = stiffness(op, law, u);
          const Vector Kv = K * v, by_force = -slope_of([&](double t) { return force(op, law, u + t * v); }, step);
          CHECK((Kv - by_force).norm() < 1e-8 * Kv.norm());
          CHECK((K - K.transpose()).norm() < 1e-12 * K.norm());
        }
      }
}

TEST_CASE("reference: special cases of one kinematics are another") {
  for (int d = 1; d <= 3; ++d) {
    CAPTURE(d);
    Cloud cloud = jittered(d);
    const auto every_bond_conventional = [&] {
      Operator op = build(cloud, {.name = "bond_augmented", .lambda = 1});
      for (EvaluationPoint& q : op.q) q.stencil = point_gradient(cloud, q.owner, 1, 1e-10);
      return op;
    };
    const Operator conventional = build(cloud, {});
    CHECK(difference(build(cloud, {.name = "sub_horizon", .parts = 1}), conventional) < 1e-12);
    CHECK(difference(build(cloud, {.name = "bond_augmented", .lambda = 1}), every_bond_conventional()) < 1e-12);
    CHECK(difference(build(cloud, {.name = "bond_associated", .bond_horizon_ratio = 2.01}), every_bond_conventional()) < 1e-12);
    cloud.influence = constant;
    CHECK(difference(build(cloud, {.name = "non_spherical", .n1 = 0, .n2 = 0}), every_bond_conventional()) < 1e-12);
    // a dominant bond is reproduced exactly: H xi_ij = u_ij
    const Vector u = displacement(cloud);
    double error = 0;
    for (const EvaluationPoint& q : build(cloud, {.name = "bond_augmented", .lambda = 1e8}).q) {
      const Matrix H = gradient(q.stencil, d, u).topLeftCorner(d, d);
      error = std::max(error, (H * cloud.bond(q.owner, q.far) - u.segment(d * q.far, d) + u.segment(d * q.owner, d)).norm());
    }
    CHECK(error < 1e-6 * u.norm());
  }
}

TEST_CASE("reference: projection with kernel weights is baqp where the point gradient is uniform") {
  const Cloud cloud = grid(2, 9, 2.015, 0, gaussian);
  const int centre = 40;
  Vector u = affine(cloud, 0.1 * Matrix::Random(2, 2));
  for (int i = 0; i < cloud.points(); ++i) u[2 * i] += 1e-2 * spacing * ((i % 9 + i / 9) % 2 == 0 ? 1 : -1);  // unseen by Fbar
  const Operator a = build(cloud, {.name = "projection", .weight = Weight::kernel}, {centre});
  const Operator b = build(cloud, {.name = "baqp"}, {centre});
  CHECK(relative(energy(a, law, u), energy(b, law, u)) < 1e-12);
  CHECK(relative(energy(build(cloud, {.name = "projection"}, {centre}), law, u), energy(b, law, u)) > 1e-3);
}

TEST_CASE("reference: families too poor for what is asked") {
  const Cloud nearest_neighbours = grid(2, 5, 1.015, 0, constant);
  const Operator conventional = build(nearest_neighbours, {});
  CHECK(difference(build(nearest_neighbours, {.name = "conventional", .order = 2}), conventional) < 1e-12);
  // the domain of a bond holds its far end alone
  for (const EvaluationPoint& q : build(nearest_neighbours, {.name = "bond_associated"}).q)
    CHECK(q.stencil.size() == conventional.q[q.owner].stencil.size());
  // a corner keeps one quadrant and all of its volume
  const Operator quadrants = build(nearest_neighbours, {.name = "sub_horizon"}, {0, 12});
  CHECK(quadrants.q.size() == 5);
  CHECK(relative(quadrants.q[0].weight, nearest_neighbours.volume[0]) < 1e-12);

  Cloud line = grid(1, 6, 2.015, 0, constant);
  line.dimension = 2;
  for (Vector& x : line.position) x.conservativeResizeLike(Vector::Zero(2));
  for (const EvaluationPoint& q : build(line, {}).q) CHECK(q.stencil.empty());
  CHECK(energy(build(line, {.name = "baqp"}), law, displacement(line)) == 0.0);
}

TEST_CASE("reference: the four-part split of a line gives every bond to exactly one part, or to two halves") {
  const Cloud line = grid(1, 21, 4, 0, constant);
  const Operator op = build(line, {.name = "sub_horizon", .parts = 4}, {10});
  REQUIRE(op.q.size() == 4);
  // bonds 1 and 2 (half), then 2 (half), 3 and 4: H of u = x^2 is sum w x^3 / sum w x^2 with w = 1, 1/2 | 1/2, 1, 1
  Vector u(21);
  for (int i = 0; i < 21; ++i) u[i] = std::pow(line.bond(10, i)[0], 2);
  CHECK(relative(gradient(op.q[2].stencil, 1, u)(0, 0), spacing * (1 + 4) / (1 + 2)) < 1e-12);
  CHECK(relative(gradient(op.q[3].stencil, 1, u)(0, 0), spacing * (4 + 27 + 64) / (2 + 9 + 16)) < 1e-12);
}

TEST_CASE("reference: selective splits an additive law into its volumetric part of Jbar and its deviatoric part of Ft") {
  const auto deviatoric = [](const Tensor& F) { return 0.4 * (std::pow(F.determinant(), -2.0 / 3) * F.squaredNorm() - 3); };
  const auto volumetric = [](const Tensor& F) { return 50 * std::pow(F.determinant() - 1, 2); };
  const Law neo_hookean{[&](const Tensor& H) {
                          const Tensor F = H + Tensor::Identity();
                          return deviatoric(F) + volumetric(F);
                        },
                        law.P, law.A};
  const Tensor own = 0.2 * Tensor::Random(), bar = 0.2 * Tensor::Random();
  const double expected = deviatoric(own + Tensor::Identity()) + volumetric(bar + Tensor::Identity());
  CHECK(relative(selective(neo_hookean, own, bar).psi, expected) < 1e-12);
  CHECK((selective(law, own, own).H - own).norm() < 1e-14);
}

TEST_CASE("reference: pair laws and penalties are variational, balanced and blind to affine motion") {
  const Elasticity elasticity{lambda, mu, 0.7};
  for (int d = 1; d <= 3; ++d)
    for (const bool broken : {false, true}) {
      CAPTURE(d);
      CAPTURE(broken);
      Cloud cloud = jittered(d);
      if (broken) cloud.integrity = [](int i, int j) { return (i + j) % 7 == 0 ? 0.0 : i * j % 5 == 1 ? 0.4 : 1.0; };
      const Vector u = displacement(cloud), v = displacement(cloud, 0.5) - 2 * u;
      for (const std::string name : {"bond_based", "ordinary"}) {
        CAPTURE(name);
        const auto E = [&](double t) { return pair_energy(cloud, name, elasticity, u + t * v); };
        const Vector f = pair_force(cloud, name, elasticity, u);
        CHECK(std::abs(f.dot(v) + slope_of(E, 1e-4)) < 1e-8 * f.norm() * v.norm());
        const auto [total, moment] = resultants(cloud, u, f);
        CHECK(total.norm() < 1e-12 * f.norm());
        CHECK(moment.norm() < 1e-12 * f.norm());
      }
      for (const std::string name : {"silling", "wan"}) {
        CAPTURE(name);
        const Matrix S = stabilization(cloud, name, elasticity, 0.5);
        CHECK((S - S.transpose()).norm() < 1e-12 * S.norm());
        CHECK((S * affine(cloud, Matrix::Random(d, d))).norm() < 1e-10 * S.norm());
        CHECK(u.dot(S * u) > 0);
      }
    }
}

TEST_CASE("reference: an interior point of the linear solid stores the classical energy") {
  const Cloud cloud = grid(3, 7, 3.015, 0, gaussian);
  const Elasticity elasticity{lambda, mu};
  const double epsilon = 1e-6, V = cloud.volume[0];
  const double small = pair_energy(cloud, "ordinary", elasticity, affine(cloud, epsilon * Matrix::Identity(3, 3)));
  CHECK(relative(small / (343 * V), elasticity.bulk(3) * std::pow(3 * epsilon, 2) / 2) < 1e-8);
}

TEST_CASE("reference: silling's force state is T = G C (omega / mean omega) z for the first order") {
  const Cloud cloud = jittered(2);
  const Vector u = displacement(cloud);
  const Elasticity elasticity{lambda, mu};
  const double C = 12 * elasticity.bulk(2) / (std::numbers::pi * std::pow(cloud.horizon, 4));
  Vector f = Vector::Zero(u.size());
  for (int i = 0; i < cloud.points(); ++i) {
    const Matrix H = gradient(point_gradient(cloud, i, 1, 1e-10), 2, u).topLeftCorner(2, 2);
    double omega0 = 0, sum_V = 0;
    for (const int j : cloud.family(i)) omega0 += cloud.omega(i, j) * cloud.volume[j], sum_V += cloud.volume[j];
    for (const int j : cloud.family(i)) {
      const Vector z = u.segment(2 * j, 2) - u.segment(2 * i, 2) - H * cloud.bond(i, j);
      const Vector T = 0.5 * C * cloud.omega(i, j) / (omega0 / sum_V) * z * cloud.volume[i] * cloud.volume[j];
      f.segment(2 * i, 2) += T;
      f.segment(2 * j, 2) -= T;
    }
  }
  CHECK((f + stabilization(cloud, "silling", elasticity, 0.5) * u).norm() < 1e-12 * f.norm());
}

TEST_CASE("reference: energy of the checkerboard at an interior point") {
  const double youngs = 210000, poisson = 0.25;
  const Law steel = saint_venant_kirchhoff(youngs * poisson / ((1 + poisson) * (1 - 2 * poisson)), youngs / (2 * (1 + poisson)));
  struct Row {
    Description kinematics;
    double constant, cubic_spline, gaussian;
  };
  const Row table[] = {{{.name = "conventional"}, 0, 0, 0},
                       {{.name = "conventional", .order = 2}, 0, 0, 0},
                       {{.name = "baqp"}, 1.037664e-1, 2.510877e-1, 1.247090e-1},
                       {{.name = "projection"}, 1.037664e-1, 1.037664e-1, 1.037664e-1},
                       {{.name = "sub_horizon"}, 4.268558e-2, 1.201349e-1, 4.733806e-2},
                       {{.name = "bond_associated"}, 6.280168e-2, 1.227817e-1, 6.697986e-2},
                       {{.name = "bond_augmented", .lambda = 10}, 2.333438e-3, 9.423944e-3, 2.572849e-3},
                       {{.name = "non_spherical", .n1 = 1, .n2 = 1}, 3.635143e-2, 3.635143e-2, 3.635143e-2}};

  // two families around the centre: all that a neighbour's point gradient sees
  Cloud block = grid(3, 13, 3.015, 0, constant);
  const int centre = 6 * (1 + 13 + 169);
  Vector u(3 * block.points());
  for (int p = 0; p < block.points(); ++p) {
    const auto sign = [&](int c) { return std::cos(std::numbers::pi * std::round(block.position[p][c] / spacing)); };
    for (int c = 0; c < 3; ++c) u[3 * p + c] = 1e-3 * spacing * sign((c + 1) % 3) * sign((c + 2) % 3);
  }
  for (const Row& row : table) {
    CAPTURE(label(row.kinematics));
    const auto density = [&](double (*influence)(double)) {
      block.influence = influence;
      return energy(build(block, row.kinematics, {centre}), steel, u) / block.volume[centre];
    };
    const auto agrees = [&](double expected, double found) {
      if (expected == 0)
        CHECK(std::abs(found) < 1e-16);
      else
        CHECK(relative(found, expected) < 1e-6);
    };
    agrees(row.constant, density(constant));
    agrees(row.cubic_spline, density(cubic_spline));
    agrees(row.gaussian, density(gaussian));
  }
}
