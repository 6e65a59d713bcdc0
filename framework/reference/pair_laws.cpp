/// Pair laws and zero-energy penalties of the dense reference: formulations that are not of the form sum_q W psi(F_q).
#include "core/eigen.hpp"
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "framework/reference/reference.hpp"

namespace perikit::reference {

namespace {

constexpr double pi = std::numbers::pi;

/// Micromodulus c of bond_based [N/m^6].
double micromodulus(int d, double horizon, const Elasticity& e) {
  if (d == 3) return 18 * e.bulk(3) / (pi * std::pow(horizon, 4));
  if (d == 2) return 12 * e.bulk(2) / (pi * e.section * std::pow(horizon, 3));
  return 2 * e.bulk(1) / (e.section * std::pow(horizon, 2));
}

struct PairLaw {
  const Cloud& cloud;
  const std::string& name;
  const Elasticity& e;
  const Vector& u;

  PairLaw(const Cloud& body, const std::string& law, const Elasticity& elasticity, const Vector& displacement)
      : cloud(body), name(law), e(elasticity), u(displacement) {
    if (name != "bond_based" && name != "ordinary") throw std::invalid_argument("no pair law '" + name + "'");
  }

  Vector deformed(int i, int j) const {
    const int d = cloud.dimension;
    return cloud.bond(i, j) + u.segment(d * j, d) - u.segment(d * i, d);
  }
  double length(int i, int j) const { return cloud.bond(i, j).norm(); }
  double extension(int i, int j) const { return deformed(i, j).norm() - length(i, j); }

  /// Surviving moment m, dilatation and surviving fraction 1 - D of the linear solid's family.
  struct Family {
    double m = 0, theta = 0, fraction = 0;
  };
  Family family(int i) const {
    Family f;
    double omega0 = 0;
    for (const int j : cloud.family(i)) {
      const double omega = cloud.omega(i, j) * cloud.volume[j], broken = cloud.intact(i, j) * omega;
      omega0 += omega;
      f.fraction += broken;
      f.m += cloud.factored(i, j) * broken * length(i, j) * length(i, j);
      f.theta += cloud.factored(i, j) * broken * length(i, j) * extension(i, j);
    }
    if (f.m > 0) f.theta *= cloud.dimension / f.m;
    if (omega0 > 0) f.fraction /= omega0;
    return f;
  }

  /// Stored energy density at i [J/m^3].
  double density(int i) const {
    const int d = cloud.dimension;
    double sum = 0;
    if (name == "bond_based") {
      const double c = micromodulus(d, cloud.horizon, e);
      for (const int j : cloud.family(i))
        sum += cloud.factored(i, j) * cloud.intact(i, j) * c * std::pow(extension(i, j), 2) / length(i, j) * cloud.volume[j] / 4;
      return sum;
    }
    const Family f = family(i);
    if (f.m <= 0) return 0;
    for (const int j : cloud.family(i)) {
      const double deviatoric = extension(i, j) - (d == 1 ? 0.0 : f.theta * length(i, j) / d);
      sum += cloud.factored(i, j) * cloud.intact(i, j) * cloud.omega(i, j) * cloud.volume[j] * deviatoric * deviatoric;
    }
    if (d == 1) return f.fraction * e.bulk(1) * sum / (2 * f.m);
    const double shear = d == 3 ? 15 * e.mu : 8 * e.mu;
    return f.fraction * (e.bulk(d) * f.theta * f.theta / 2 + shear * sum / (2 * f.m));
  }

  /// Scalar force state t_ij [N/m^6].
  double state(int i, int j, const Family& f) const {
    const int d = cloud.dimension;
    const double b = cloud.factored(i, j) * cloud.intact(i, j), x = length(i, j), extended = extension(i, j);
    if (b == 0) return 0;
    if (name == "bond_based") return b * micromodulus(d, cloud.horizon, e) * extended / x / 2;
    const double factor = f.fraction * b * cloud.omega(i, j) / f.m;
    if (d == 1) return factor * e.bulk(1) * extended;
    const double shear = d == 3 ? 15 * e.mu : 8 * e.mu;
    return factor * (d * e.bulk(d) * f.theta * x + shear * (extended - f.theta * x / d));
  }
};

}  // namespace

double pair_energy(const Cloud& cloud, const std::string& name, const Elasticity& elasticity, const Vector& u) {
  const PairLaw law{cloud, name, elasticity, u};
  double total = 0;
  for (int i = 0; i < cloud.points(); ++i) total += cloud.volume[i] * law.density(i);
  return total;
}

Vector pair_force(const Cloud& cloud, const std::string& name, const Elasticity& elasticity, const Vector& u) {
  const PairLaw law{cloud, name, elasticity, u};
  const int d = cloud.dimension;
  Vector f = Vector::Zero(d * cloud.points());
  for (int i = 0; i < cloud.points(); ++i) {
    const PairLaw::Family family = law.family(i);
    for (const int j : cloud.family(i)) {
      const Vector t = law.state(i, j, family) * law.deformed(i, j).normalized() * cloud.volume[i] * cloud.volume[j];
      f.segment(d * i, d) += t;
      f.segment(d * j, d) -= t;
    }
  }
  return f;
}

Matrix stabilization(const Cloud& cloud, const std::string& name, const Elasticity& elasticity, double coefficient, int order,
                     double singular, bool whole) {
  if (name != "silling" && name != "wan") throw std::invalid_argument("no stabilization '" + name + "'");
  const int d = cloud.dimension, n = cloud.points();
  Matrix S = Matrix::Zero(d * n, d * n);
  for (int i = 0; i < n; ++i) {
    const Stencil own = point_gradient(cloud, i, order, singular);
    if (own.empty()) continue;
    double omega0 = 0, sum_V = 0;
    Matrix K = Matrix::Zero(d, d);
    for (const int j : cloud.family(i)) {
      const Vector xi = cloud.bond(i, j);
      omega0 += cloud.omega(i, j) * cloud.volume[j];
      sum_V += cloud.volume[j];
      K += cloud.intact(i, j) * cloud.omega(i, j) * cloud.volume[j] * xi * xi.transpose();
    }
    Matrix M;  // T_z = omega M z
    if (name == "silling") {
      M = coefficient * micromodulus(d, cloud.horizon, elasticity) / cloud.horizon * sum_V / omega0 * Matrix::Identity(d, d);
    } else {
      const Matrix inverse = K.inverse();
      M = elasticity.lambda * inverse.trace() * Matrix::Identity(d, d) + 2 * elasticity.mu * inverse;
    }
    const std::vector<int> family = cloud.family(i);
    const Matrix fit = whole ? polynomial_fit(cloud, i, order, singular) : Matrix();
    for (std::size_t m = 0; m < family.size(); ++m) {
      // z_ij = u_j - u_i - Hbar_i xi_ij = sum_k z_k u_k, or the whole fit instead of Hbar_i xi_ij
      const int j = family[m];
      Vector z = Vector::Zero(n);
      z[j] += 1;
      z[i] -= 1;
      if (whole) {
        for (std::size_t k = 0; k < family.size(); ++k) {
          const double share = fit(static_cast<Eigen::Index>(m), static_cast<Eigen::Index>(k));
          z[family[k]] -= share;
          z[i] += share;
        }
      } else {
        for (const auto& [k, g] : own) z[k] -= g.dot(cloud.bond(i, j));
      }
      const double factor = cloud.volume[i] * cloud.volume[j] * cloud.intact(i, j) * cloud.omega(i, j);
      std::vector<int> touched;
      for (int k = 0; k < n; ++k)
        if (z[k] != 0) touched.push_back(k);
      for (const int k : touched)
        for (const int l : touched) S.block(d * k, d * l, d, d) += factor * z[k] * z[l] * M;
    }
  }
  return S;
}

}  // namespace perikit::reference
