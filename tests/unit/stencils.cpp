/// Stencils: exact for affine motion, their adjoint, and the bond formula that packs and numbers share.

#include "spaces/weighted/local_stencil.hpp"

#include <doctest/doctest.h>

#include <random>

#include "spaces/bond_shape.hpp"

using namespace perikit;

namespace {

constexpr int bonds = 14;

double noise(std::mt19937& random) { return std::uniform_real_distribution<double>(-1, 1)(random); }

FamilyArrays random_family(std::mt19937& random) {
  FamilyArrays f;
  f.resize(3, bonds);
  for (std::size_t k = 0; k < bonds; ++k) {
    double square = 0;
    for (auto& xi : f.xi) {
      xi[k] = noise(random);
      square += xi[k] * xi[k];
    }
    f.length[k] = std::sqrt(square);
    f.volume[k] = 1 + 0.5 * noise(random);
    f.omega[k] = 0.6 + 0.3 * noise(random);
  }
  return f;
}

/// An evaluation point for each bond, which sees near bonds more.
class Nearby final : public WeightedKinematics {
 public:
  WeightedTraits traits() const noexcept override { return {}; }
  int parts(int) const override { return 0; }
  void weights(const FamilyView& f, double* omega, std::size_t stride) const noexcept override {
    for (int q = 0; q < f.bonds; ++q)
      for (int k = 0; k < f.bonds; ++k) {
        double square = 0;
        for (const double* xi : f.xi) square += (xi[q] - xi[k]) * (xi[q] - xi[k]);
        omega[static_cast<std::size_t>(q) * stride + static_cast<std::size_t>(k)] = f.omega[k] / (1 + square);
      }
  }
};

}  // namespace

TEST_CASE("local stencil: exact for affine motion, and its adjoint is the transpose") {
  std::mt19937 random(7);
  const Formulation formulation = make_formulation(std::make_shared<Nearby>());
  for (int trial = 0; trial < 10; ++trial) {
    const FamilyArrays f = random_family(random);
    const AlignedVector<double> share(f.size, 1.0 / bonds);
    double G[3][3];
    AlignedVector<double> u[3], v[3];
    for (int c = 0; c < 3; ++c) {
      for (double& g : G[c]) g = noise(random);
      u[c].assign(f.size, 0.0);
      v[c].assign(f.size, 0.0);
      for (std::size_t k = 0; k < bonds; ++k) {
        for (int e = 0; e < 3; ++e) u[c][k] += G[c][e] * f.xi[e][k];
        v[c][k] = noise(random);
      }
    }
    const double* fields[2][3] = {{u[0].data(), u[1].data(), u[2].data()}, {v[0].data(), v[1].data(), v[2].data()}};
    LocalStencil<3> stencil;
    stencil.build({&formulation, 2.0}, f, share.data(), 2, fields);
    REQUIRE(stencil.points() == bonds);
    constexpr std::size_t stride = 16;
    AlignedVector<double> H(9 * stride), P(9 * stride);
    stencil.gradient(0, 0, bonds, H.data(), stride);
    for (int c = 0; c < 3; ++c)
      for (int e = 0; e < 3; ++e)
        for (std::size_t q = 0; q < bonds; ++q) CHECK(H[static_cast<std::size_t>(3 * c + e) * stride + q] == doctest::Approx(G[c][e]).epsilon(1e-11));
    // sum_q P_q : H_q(v) = sum_k t_k . v_k
    for (double& p : P) p = noise(random);
    stencil.gradient(1, 0, bonds, H.data(), stride);
    double work = 0, force_work = 0;
    for (std::size_t c = 0; c < 9; ++c)
      for (std::size_t q = 0; q < bonds; ++q) work += P[c * stride + q] * H[c * stride + q];
    stencil.add_stress(0, bonds, P.data(), stride);
    AlignedVector<double> t[3];
    for (auto& component : t) component.assign(f.size, 0.0);
    double* pointers[3] = {t[0].data(), t[1].data(), t[2].data()};
    stencil.adjoint(pointers);
    for (int c = 0; c < 3; ++c)
      for (std::size_t k = 0; k < bonds; ++k) force_work += t[c][k] * v[c][k];
    CHECK(force_work == doctest::Approx(work).epsilon(1e-11));
  }
}

TEST_CASE("bond shape: exact along the bond, its adjoint is the transpose, and packs agree with numbers") {
  std::mt19937 random(9);
  double A[3], xi[3], g[3], H[3], P[3];
  for (int e = 0; e < 3; ++e) A[e] = noise(random), xi[e] = noise(random), P[e] = noise(random);
  const double square = xi[0] * xi[0] + xi[1] * xi[1] + xi[2] * xi[2], du = noise(random);
  for (int e = 0; e < 3; ++e) g[e] = xi[e] / square;
  bond_shape_row<3>(A, du, xi, g, H);
  CHECK(H[0] * xi[0] + H[1] * xi[1] + H[2] * xi[2] == doctest::Approx(du).epsilon(1e-14));
  double work = 0;
  for (int e = 0; e < 3; ++e) work += P[e] * H[e];
  const double t = bond_shape_row_adjoint<3>(P, xi, g);
  CHECK(t * du + P[0] * A[0] + P[1] * A[1] + P[2] * A[2] == doctest::Approx(work).epsilon(1e-14));
  Pack a[3], x[3], h[3], correction[3];
  for (int e = 0; e < 3; ++e) a[e] = Pack(A[e]), x[e] = Pack(xi[e]), correction[e] = Pack(g[e]);
  bond_shape_row<3>(a, Pack(du), x, correction, h);
  for (int e = 0; e < 3; ++e) CHECK(h[e][0] == doctest::Approx(H[e]).epsilon(1e-15));
}
