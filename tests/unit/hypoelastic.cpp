/// The rate law against closed forms and against the incremental algorithm as Partmann et al. print it (signs corrected).

#include <doctest/doctest.h>

#include <Eigen/Dense>

#include "materials/hypoelastic/law.hpp"
#include "perikit/sdk/law_material.hpp"
#include "tests/contract/material_contract.hpp"

using namespace perikit;
using contract::Evaluation;
using contract::Matrix;
using Eigen::Matrix3d;

namespace {

const std::vector<double> constants{1.2, 0.8};
constexpr double lambda = 1.2, mu = 0.8;

Matrix matrix_of(const Matrix3d& a) {
  Matrix m;
  for (int i = 0; i < 9; ++i) m[i] = a(i / 3, i % 3);
  return m;
}
Matrix3d eigen_of(const Matrix& m) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(m.data());
}

struct End {
  Matrix3d P, sigma;
  double psi;
};

/// The end of the path F(t), 0 <= t <= 1, F(0) = I, in equal steps.
template <class Path>
End follow(Space space, const Path& path, int steps) {
  const LawMaterial<Hypoelastic> material;
  std::vector<contract::Values> history;
  for (int n = 1;; ++n) {
    const Matrix3d F = path(double(n) / steps);
    const Evaluation e(material, space, constants, {contract::restrict_to(space, matrix_of(F - Matrix3d::Identity()))}, {}, false,
                       history);
    REQUIRE(e.status.ok());
    history = {e.at(e.state, 0)};
    if (n < steps) continue;
    const Matrix3d P = eigen_of(contract::extend(space, e.at(e.P, 0)));
    return {P, P * F.transpose() / F.determinant(), e.psi.data()[0]};
  }
}

/// Errors at n and 2 n steps fall by four.
template <class Path>
void check_second_order(const Path& path, const Matrix3d& sigma, const std::string& what) {
  const double coarse = (follow(Space::solid, path, 20).sigma - sigma).norm(),
               fine = (follow(Space::solid, path, 40).sigma - sigma).norm();
  CHECK_MESSAGE(coarse > 1e-9, what);
  CHECK_MESSAGE(coarse / fine == doctest::Approx(4).epsilon(0.05), what, ": ", coarse, " ", fine);
}

/// Partmann et al., 4.45-4.57, forward steps: Q with the plus sign in its last term and its limit for no rotation.
Matrix3d incremental_algorithm(const std::function<Matrix3d(double)>& path, int steps) {
  Matrix3d v = Matrix3d::Identity(), R = v, s = Matrix3d::Zero();
  const double dt = 1.0 / steps;
  for (int n = 0; n < steps; ++n) {
    const Matrix3d F0 = path(n * dt), F1 = path((n + 1) * dt), l = (F1 - F0) / dt * (0.5 * (F0 + F1)).inverse();
    const Matrix3d d = 0.5 * (l + l.transpose()), w = 0.5 * (l - l.transpose());
    const Matrix3d dv = d * v;
    const auto axial = [](const Matrix3d& a) {
      return Eigen::Vector3d(a(1, 2) - a(2, 1), a(2, 0) - a(0, 2), a(0, 1) - a(1, 0));
    };  // e_ijk a_jk
    const Eigen::Vector3d p = -0.5 * axial(w), z = -axial(dv), q = p + (v.trace() * Matrix3d::Identity() - v).inverse() * z;
    Matrix3d Omega;  // e_ikj q_k
    Omega << 0, -q(2), q(1), q(2), 0, -q(0), -q(1), q(0), 0;
    const double rate = q.norm();
    Matrix3d Q = Matrix3d::Identity();
    if (rate > 0) Q += std::sin(dt * rate) / rate * Omega + (1 - std::cos(dt * rate)) / (rate * rate) * Omega * Omega;
    CHECK((Q.transpose() * Q - Matrix3d::Identity()).norm() < 1e-14);
    R = Q * R;
    v += dt * (l * v - v * Omega);
    const Matrix3d strain = dt * R.transpose() * d * R;
    s += lambda * strain.trace() * Matrix3d::Identity() + 2 * mu * strain;
  }
  return R * s * R.transpose();
}

}  // namespace

TEST_CASE("contract: hypoelastic") {
  for (const double nu : {-0.3, 0.0, 0.25, 0.499})
    contract::check_material(LawMaterial<Hypoelastic>(), {2 * nu / (1 - 2 * nu), 1.0}, {.law = "hypoelastic"});
}

TEST_CASE("hypoelastic: simple shear against the closed form of Dienes") {
  const double shear = 4.0, beta = std::atan(shear / 2), c = std::cos(beta), s = std::sin(beta);
  Matrix3d sigma = Matrix3d::Zero();
  sigma(0, 0) = 4 * mu * (std::cos(2 * beta) * std::log(c) + beta * std::sin(2 * beta) - s * s);
  sigma(1, 1) = -sigma(0, 0);
  sigma(0, 1) = sigma(1, 0) = 2 * mu * std::cos(2 * beta) * (2 * beta - 2 * std::tan(2 * beta) * std::log(c) - std::tan(beta));
  const auto path = [&](double t) {
    Matrix3d F = Matrix3d::Identity();
    F(0, 1) = t * shear;
    return F;
  };
  check_second_order(path, sigma, "simple shear");
  const End end = follow(Space::plane_strain, path, 2000);
  CHECK((end.sigma - sigma).norm() < 2e-6);
}

TEST_CASE("hypoelastic: without rotation the stress is linear in the logarithmic stretch") {
  const auto path = [](double t) -> Matrix3d { return Eigen::Vector3d(1 + t, 1 - 0.3 * t, 1 + 0.2 * t * t).asDiagonal(); };
  const Eigen::Vector3d h(std::log(2.0), std::log(0.7), std::log(1.2));
  const Matrix3d sigma = (lambda * h.sum() * Eigen::Vector3d::Ones() + 2 * mu * h).asDiagonal();
  check_second_order(path, sigma, "stretch");
}

TEST_CASE("hypoelastic: one small increment is linear elasticity, energy included") {
  const auto path = [](double t) -> Matrix3d {
    Matrix3d G;
    G << 1, 0.5, -0.2, 0.3, -0.4, 0.1, 0.6, -0.3, 0.2;
    return Matrix3d::Identity() + 1e-7 * t * G;
  };
  const Matrix3d e = 0.5 * (path(1) + path(1).transpose()) - Matrix3d::Identity();
  const Matrix3d sigma = lambda * e.trace() * Matrix3d::Identity() + 2 * mu * e;
  const End end = follow(Space::solid, path, 1);
  CHECK((end.P - sigma).norm() < 1e-6 * sigma.norm());
  CHECK(end.psi == doctest::Approx(0.5 * (sigma.array() * e.array()).sum()).epsilon(1e-6));
}

TEST_CASE("hypoelastic: psi is the work of the stress, and a turning path converges to the incremental algorithm") {
  const std::function<Matrix3d(double)> path = [](double t) -> Matrix3d {
    Matrix3d A, B;
    A << 0.3, 0.5, -0.2, 0.1, -0.3, 0.2, -0.4, 0.1, 0.2;
    B << -0.2, 0.1, 0.2, 0.3, 0.1, -0.1, 0.1, -0.2, 0.1;
    return Eigen::AngleAxisd(2 * t, Eigen::Vector3d(2, -1, 2).normalized()).toRotationMatrix() *
           (Matrix3d::Identity() + t * A + std::sin(3 * t) * B);
  };
  const auto work = [&](int steps) {
    double sum = 0;
    Matrix3d P = Matrix3d::Zero();
    for (int n = 1; n <= steps; ++n) {
      // the stress after n of `steps` steps, from its own path
      const auto part = [&](double t) { return path(t * n / steps); };
      const Matrix3d next = follow(Space::solid, part, n).P;
      sum += 0.5 * ((P + next).array() * (path(double(n) / steps) - path(double(n - 1) / steps)).array()).sum();
      P = next;
    }
    return sum;
  };
  const double coarse = std::abs(work(20) - follow(Space::solid, path, 20).psi),
               fine = std::abs(work(40) - follow(Space::solid, path, 40).psi);
  CHECK(coarse < 1e-2);
  CHECK(coarse / fine == doctest::Approx(4).epsilon(0.1));

  // The printed algorithm is of first order: extrapolate.
  const Matrix3d algorithm = 2 * incremental_algorithm(path, 4000) - incremental_algorithm(path, 2000);
  const Matrix3d found = follow(Space::solid, path, 2000).sigma;
  CHECK_MESSAGE((algorithm - found).norm() < 1e-6, (algorithm - found).norm());
}
