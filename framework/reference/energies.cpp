/// Energies, forces and tangents of the stencils in stencils.cpp.
#include "core/eigen.hpp"
#include <cmath>

#include "framework/reference/reference.hpp"

namespace perikit::reference {

namespace {

using Components = Eigen::Matrix<double, 9, 1>;

Components flat(const Tensor& T) {
  Components v;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) v[3 * r + c] = T(r, c);
  return v;
}

Tensor square(const Components& v) {
  Tensor T;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) T(r, c) = v[3 * r + c];
  return T;
}

double dot(const Tensor& A, const Tensor& B) {
  return A.cwiseProduct(B).sum();
}

/// The stencils an evaluation point depends on: its own, and its owner's where the map of `selective` acts.
std::vector<const Stencil*> stencils(const Operator& op, const EvaluationPoint& q) {
  if (op.owner_gradient.empty() || op.owner_gradient[q.owner].empty()) return {&q.stencil};
  return {&q.stencil, &op.owner_gradient[q.owner]};
}

void subtract_force(const Stencil& stencil, int d, const Tensor& WP, Vector& f) {
  const Matrix in_space = WP.topLeftCorner(d, d);
  for (const auto& [k, g] : stencil) f.segment(d * k, d) -= in_space * g;
}

/// T_ij V_j V_i on i and its reaction on j, from the bond's own entry of its stencil.
void subtract_bond_force(const EvaluationPoint& q, int d, const Tensor& WP, Vector& f) {
  for (const auto& [k, g] : q.stencil)
    if (k == q.far) subtract_force({{q.far, g}, {q.owner, -g}}, d, WP, f);
}

}  // namespace

Tensor gradient(const Stencil& stencil, int d, const Vector& u) {
  Tensor H = Tensor::Zero();
  for (const auto& [k, g] : stencil) H.topLeftCorner(d, d) += u.segment(d * k, d) * g.transpose();
  return H;
}

Selective selective(const Law& law, const Tensor& H_own, const Tensor& H_bar, double share) {
  const Tensor Ft = H_own + Tensor::Identity(), Fb = H_bar + Tensor::Identity();
  const Tensor inverse_t = Ft.inverse(), inverse_b = Fb.inverse();
  const Tensor Ftm = inverse_t.transpose(), Fbm = inverse_b.transpose();
  const double q = std::cbrt(Fb.determinant() / Ft.determinant()), a = 1 - share + share * q, m = share * q;
  const Tensor Fh = a * Ft;
  Selective r;
  r.H = Fh - Tensor::Identity();
  r.psi = law.psi(r.H);
  const Tensor Ph = law.P(r.H);
  const double p = m * dot(Ph, Ft);
  r.S_own = a * Ph - p / 3 * Ftm;
  r.S_bar = p / 3 * Fbm;

  const Matrix A = law.A(r.H);
  r.tangent.resize(18, 18);
  for (int column = 0; column < 18; ++column) {
    Tensor dFt = Tensor::Zero(), dFb = Tensor::Zero();
    (column < 9 ? dFt : dFb)(column % 9 / 3, column % 3) = 1;
    const double phi = ((inverse_b * dFb).trace() - (inverse_t * dFt).trace()) / 3;
    const Tensor dFh = a * dFt + m * phi * Ft;
    const Tensor dPh = square(A * flat(dFh));
    const double dp = m * (phi * dot(Ph, Ft) + dot(dPh, Ft) + dot(Ph, dFt));
    r.tangent.col(column).head(9) = flat(a * dPh + m * phi * Ph - dp / 3 * Ftm + p / 3 * Ftm * dFt.transpose() * Ftm);
    r.tangent.col(column).tail(9) = flat(dp / 3 * Fbm - p / 3 * Fbm * dFb.transpose() * Fbm);
  }
  return r;
}

double energy(const Operator& op, const Law& law, const Vector& u) {
  double total = 0;
  for (const EvaluationPoint& q : op.q) {
    const auto s = stencils(op, q);
    const Tensor H = gradient(*s[0], op.dimension, u);
    total += q.weight * (s.size() == 1 ? law.psi(H) : selective(law, H, gradient(*s[1], op.dimension, u), op.owner_share[q.owner]).psi);
  }
  return total;
}

Vector force(const Operator& op, const Law& law, const Vector& u) {
  const int d = op.dimension;
  Vector f = Vector::Zero(d * op.points);
  for (const EvaluationPoint& q : op.q) {
    const auto s = stencils(op, q);
    const Tensor H = gradient(*s[0], d, u);
    const auto subtract_own = [&](const Tensor& P) {
      if (op.owner_volume.empty()) subtract_force(*s[0], d, q.weight * P, f);
      else subtract_bond_force(q, d, op.owner_volume[q.owner] * q.volume_share * P, f);
    };
    if (s.size() == 1) {
      subtract_own(law.P(H));
    } else {
      const Selective r = selective(law, H, gradient(*s[1], d, u), op.owner_share[q.owner]);
      subtract_own(r.S_own);
      subtract_force(*s[1], d, q.weight * r.S_bar, f);
    }
  }
  return f;
}

Matrix stiffness(const Operator& op, const Law& law, const Vector& u) {
  const int d = op.dimension;
  Matrix K = Matrix::Zero(d * op.points, d * op.points);
  for (const EvaluationPoint& q : op.q) {
    const auto s = stencils(op, q);
    const Tensor H = gradient(*s[0], d, u);
    const Matrix A = s.size() == 1 ? law.A(H) : selective(law, H, gradient(*s[1], d, u), op.owner_share[q.owner]).tangent;

    // B: tensor components (of one or two gradients) from the displacements of the points that appear
    std::vector<int> rows;
    for (const Stencil* stencil : s)
      for (const auto& [k, g] : *stencil)
        for (int a = 0; a < d; ++a) rows.push_back(d * k + a);
    Matrix B = Matrix::Zero(static_cast<Eigen::Index>(9 * s.size()), static_cast<Eigen::Index>(rows.size()));
    Eigen::Index column = 0;
    for (std::size_t block = 0; block < s.size(); ++block)
      for (const auto& [k, g] : *s[block])
        for (int a = 0; a < d; ++a, ++column)
          for (int b = 0; b < d; ++b) B(static_cast<Eigen::Index>(9 * block + 3 * a + b), column) = g[b];

    const Matrix local = q.weight * B.transpose() * A * B;
    for (std::size_t r = 0; r < rows.size(); ++r)
      for (std::size_t c = 0; c < rows.size(); ++c)
        K(rows[r], rows[c]) += local(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c));
  }
  return K;
}

}  // namespace perikit::reference
