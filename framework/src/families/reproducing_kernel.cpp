#include "families/reproducing_kernel.hpp"

#include <array>

#include "core/eigen.hpp"
#include "core/symmetric_matrix.hpp"
#include "families/shape_tensor.hpp"

namespace perikit {

namespace {

/// Exponents of the monomials of degree 1 ... order, the linear ones first, in the order of the axes.
std::vector<std::array<int, 3>> exponents(int dimension, int order) {
  std::vector<std::array<int, 3>> all;
  for (int degree = 1; degree <= order; ++degree)
    for (int a = degree; a >= 0; --a)
      for (int b = degree - a; b >= 0; --b) {
        const int c = degree - a - b;
        if ((dimension > 1 || b == 0) && (dimension > 2 || c == 0)) all.push_back({a, b, c});
      }
  return all;
}

double power(double x, int n) {
  double value = 1;
  for (; n > 0; --n) value *= x;
  return value;
}

/// Monomials by bond, and the weights of bonds.
struct Monomials {
  Eigen::MatrixXd q;        ///< a row a monomial
  Eigen::VectorXd weight;

  Monomials(const FamilyArrays& family, double horizon, int order) {
    const auto d = static_cast<std::size_t>(family.dimension), bonds = static_cast<std::size_t>(family.bonds);
    const auto terms = exponents(family.dimension, order);
    q.resize(static_cast<Eigen::Index>(terms.size()), static_cast<Eigen::Index>(bonds));
    weight.resize(static_cast<Eigen::Index>(bonds));
    for (std::size_t k = 0; k < bonds; ++k) {
      weight(static_cast<Eigen::Index>(k)) = family.omega[k] * family.volume[k];
      for (std::size_t t = 0; t < terms.size(); ++t) {
        double value = 1;
        for (std::size_t c = 0; c < d; ++c) value *= power(family.xi[c][k] / horizon, terms[t][c]);
        q(static_cast<Eigen::Index>(t), static_cast<Eigen::Index>(k)) = value;
      }
    }
  }

  Eigen::VectorXd root() const { return weight.cwiseSqrt(); }
  /// W^(1/2) q^T = Q R
  Eigen::HouseholderQR<Eigen::MatrixXd> qr() const { return Eigen::HouseholderQR<Eigen::MatrixXd>(root().asDiagonal() * q.transpose()); }
};

/// By bond and axis: sum_a of_monomial(a, e) (M^-1 q(xi_k))_a omega V_k, M^-1 q W = R^-1 Q^T W^(1/2) with W^(1/2) q^T = Q R, whose condition is the root of
/// M's. With its eigenvalues 3e7 apart (order 8 in 3D) the gradient is exact to 1e-12 (tests/unit/gradient_order.cpp), where the inverse of M would
/// lose seven digits. of_monomial is overwritten.
Eigen::MatrixXd weigh_monomials(const Monomials& monomials, Eigen::MatrixXd& of_monomial) {
  const Eigen::Index size = monomials.q.rows(), bonds = monomials.q.cols();
  const auto qr = monomials.qr();
  qr.matrixQR().topRows(size).triangularView<Eigen::Upper>().transpose().solveInPlace(of_monomial);   // R^-T
  Eigen::MatrixXd spread = Eigen::MatrixXd::Zero(bonds, of_monomial.cols());
  spread.topRows(size) = of_monomial;
  return (qr.householderQ() * spread).transpose() * monomials.root().asDiagonal();
}

bool exactly(const FamilyArrays& family, double horizon, int order, std::vector<double>& g) {
  const auto d = static_cast<std::size_t>(family.dimension), bonds = static_cast<std::size_t>(family.bonds);
  const Monomials monomials(family, horizon, order);
  const Eigen::MatrixXd& q = monomials.q;
  const Eigen::Index size = q.rows();
  const Eigen::MatrixXd M = q * monomials.weight.asDiagonal() * q.transpose();
  const SymmetricEigen eigen(static_cast<int>(size), M.data(), false);
  if (!(eigen.largest() > 0) || !(eigen.least() >= singular_ratio * eigen.largest())) return false;
  const auto rows = static_cast<Eigen::Index>(d);
  Eigen::MatrixXd linear = Eigen::MatrixXd::Zero(size, rows);
  linear.topRows(rows).setIdentity();
  const Eigen::MatrixXd stencil = weigh_monomials(monomials, linear) / horizon;
  for (std::size_t k = 0; k < bonds; ++k)
    for (std::size_t e = 0; e < d; ++e) g[k * d + e] = stencil(static_cast<Eigen::Index>(e), static_cast<Eigen::Index>(k));
  return true;
}

}  // namespace

int reproducing_kernel(const FamilyArrays& family, double horizon, int order, std::vector<double>& g) {
  g.assign(static_cast<std::size_t>(family.bonds) * static_cast<std::size_t>(family.dimension), 0.0);
  if (family.bonds == 0) return 0;
  for (; order > 0; --order)
    if (exactly(family, horizon, order, g)) return order;
  return 0;
}

void kernel_gradients_at(const FamilyArrays& family, double horizon, int order, std::span<const std::array<double, 3>> places, std::vector<double>& g) {
  const auto d = static_cast<std::size_t>(family.dimension), bonds = static_cast<std::size_t>(family.bonds);
  g.assign(places.size() * bonds * d, 0.0);
  if (order < 1) return;
  const Monomials monomials(family, horizon, order);
  const auto terms = exponents(family.dimension, order);
  Eigen::MatrixXd derivatives(monomials.q.rows(), static_cast<Eigen::Index>(places.size() * d));   // of the monomials at the places
  for (std::size_t q = 0; q < places.size(); ++q)
    for (std::size_t e = 0; e < d; ++e)
      for (std::size_t t = 0; t < terms.size(); ++t) {
        double value = terms[t][e];
        for (std::size_t c = 0; c < d && value != 0; ++c) value *= power(places[q][c] / horizon, terms[t][c] - (c == e ? 1 : 0));
        derivatives(static_cast<Eigen::Index>(t), static_cast<Eigen::Index>(q * d + e)) = value;
      }
  const Eigen::MatrixXd stencil = weigh_monomials(monomials, derivatives) / horizon;
  for (std::size_t q = 0; q < places.size(); ++q)
    for (std::size_t k = 0; k < bonds; ++k)
      for (std::size_t e = 0; e < d; ++e) g[(q * bonds + k) * d + e] = stencil(static_cast<Eigen::Index>(q * d + e), static_cast<Eigen::Index>(k));
}

void kernel_residuals(const FamilyArrays& family, double horizon, int order, std::span<const double> u, std::vector<double>& z) {
  z.assign(u.begin(), u.end());
  if (order < 1) return;
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const Monomials monomials(family, horizon, order);
  Eigen::Map<Rows> values(z.data(), family.bonds, static_cast<Eigen::Index>(z.size()) / family.bonds);
  const Eigen::VectorXd root = monomials.root();
  const Eigen::MatrixXd weighted = root.asDiagonal() * monomials.q.transpose();
  const Eigen::MatrixXd coefficients = weighted.householderQr().solve(root.asDiagonal() * values);
  values -= monomials.q.transpose() * coefficients;
}

std::size_t orthonormal_polynomials(const FamilyArrays& family, double horizon, int order, std::vector<double>& phi) {
  phi.clear();
  if (order < 1) return 0;
  const Monomials monomials(family, horizon, order);
  const Eigen::VectorXd root = monomials.root();
  const auto qr = monomials.qr();
  const Eigen::Index count = monomials.q.rows();
  const Eigen::MatrixXd basis = qr.householderQ() * Eigen::MatrixXd::Identity(family.bonds, count);
  phi.reserve(static_cast<std::size_t>(family.bonds * count));
  for (Eigen::Index k = 0; k < family.bonds; ++k)
    for (Eigen::Index a = 0; a < count; ++a) phi.push_back(root(k) > 0 ? basis(k, a) / root(k) : 0.0);
  return static_cast<std::size_t>(count);
}

}  // namespace perikit
