#include "framework/reference/reference.hpp"

#include "core/eigen.hpp"
#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>

namespace perikit::reference {

namespace {

using Accumulator = std::map<int, Vector>;

Stencil finished(const Accumulator& a) {
  return {a.begin(), a.end()};
}

void add(Accumulator& to, int k, const Vector& g) {
  const auto [entry, fresh] = to.try_emplace(k, g);
  if (!fresh) entry->second += g;
}

void add(Accumulator& to, const Stencil& stencil, double factor) {
  for (const auto& [k, g] : stencil) add(to, k, factor * g);
}

/// Monomials of total degree 1 ... order of x, by degree, the linear ones first in the order of the axes.
Vector monomials(const Vector& x, int order) {
  std::vector<double> values;
  const int d = static_cast<int>(x.size());
  for (int degree = 1; degree <= order; ++degree)
    for (int a = degree; a >= 0; --a)
      for (int b = degree - a; b >= 0; --b) {
        const int c = degree - a - b;
        if ((d < 2 && b > 0) || (d < 3 && c > 0)) continue;
        values.push_back(std::pow(x[0], a) * (d > 1 ? std::pow(x[1], b) : 1.0) * (d > 2 ? std::pow(x[2], c) : 1.0));
      }
  return Eigen::Map<Vector>(values.data(), static_cast<Eigen::Index>(values.size()));
}

/// Smallest over largest eigenvalue of the shape tensor of influence omega(k); 0 where it is zero.
double eigenvalue_ratio(const Cloud& cloud, int i, const std::vector<int>& family, const std::function<double(int)>& omega) {
  Matrix K = Matrix::Zero(cloud.dimension, cloud.dimension);
  for (const int k : family) K += omega(k) * cloud.volume[k] * cloud.bond(i, k) * cloud.bond(i, k).transpose();
  const Vector values = Eigen::SelfAdjointEigenSolver<Matrix>(K).eigenvalues();
  return values[values.size() - 1] > 0 ? values[0] / values[values.size() - 1] : 0.0;
}

/// Reproducing-kernel gradient at i of exactly this order with influence omega(k); empty when the moment is singular.
Stencil kernel_gradient(const Cloud& cloud, int i, int order, double singular, const std::vector<int>& family,
                        const std::function<double(int)>& omega) {
  if (family.empty()) return {};
  const int d = cloud.dimension;
  const auto Q = [&](int k) { return monomials(cloud.bond(i, k) / cloud.horizon, order); };
  const Eigen::Index size = Q(family.front()).size();
  Matrix M = Matrix::Zero(size, size);
  for (const int k : family) M += omega(k) * cloud.volume[k] * Q(k) * Q(k).transpose();
  const Eigen::SelfAdjointEigenSolver<Matrix> eigen(M);
  const Vector values = eigen.eigenvalues();  // ascending
  if (!(values[size - 1] > 0) || values[0] < singular * values[size - 1]) return {};
  const Matrix inverse = eigen.eigenvectors() * values.cwiseInverse().asDiagonal() * eigen.eigenvectors().transpose();
  Accumulator g;
  for (const int k : family) {
    const Vector g_k = omega(k) * cloud.volume[k] / cloud.horizon * (inverse * Q(k)).head(d);
    add(g, k, g_k);
    add(g, i, -g_k);
  }
  return finished(g);
}

/// Derivatives of the monomials by the axes, a row each.
Matrix monomial_derivatives(const Vector& x, int order) {
  // Of products of powers, factor by factor.
  const auto d = x.size();
  std::vector<Vector> rows;
  for (int degree = 1; degree <= order; ++degree)
    for (int a = degree; a >= 0; --a)
      for (int b = degree - a; b >= 0; --b) {
        const int power[3] = {a, b, degree - a - b};
        if ((d < 2 && b > 0) || (d < 3 && power[2] > 0)) continue;
        Vector row(d);
        for (Eigen::Index e = 0; e < d; ++e) {
          row[e] = power[e];
          for (Eigen::Index c = 0; c < d; ++c) row[e] *= c == e ? (power[c] > 0 ? std::pow(x[c], power[c] - 1) : 0.0) : std::pow(x[c], power[c]);
        }
        rows.push_back(row);
      }
  Matrix result(static_cast<Eigen::Index>(rows.size()), d);
  for (std::size_t r = 0; r < rows.size(); ++r) result.row(static_cast<Eigen::Index>(r)) = rows[r].transpose();
  return result;
}

/// Share of a bond in sub-horizon `part`: 1 inside, halved for every dividing plane that it lies on, 0 outside.
double share(const Vector& xi, double horizon, int parts, int part) {
  const double on_plane = 1e-9 * horizon;
  const auto side = [&](double distance) { return std::abs(distance) <= on_plane ? 0.5 : distance > 0 ? 1.0 : 0.0; };
  if (parts == 1) return 1;
  if (xi.size() == 1 && parts == 4) {
    const double lower = part == 0 ? 1.0 : side(xi[0] - (0.5 * part - 1.0) * horizon);
    const double upper = part == 3 ? 1.0 : side((0.5 * part - 0.5) * horizon - xi[0]);
    return lower * upper;
  }
  double product = 1;
  for (int c = 0; c < xi.size(); ++c) product *= side((part >> c & 1) != 0 ? -xi[c] : xi[c]);
  return product;
}

/// Builds the evaluation points of one kinematics, owner by owner.
class Builder {
 public:
  Builder(const Cloud& cloud, const Description& description) : cloud_(cloud), description_(description) {}

  void append(int i, std::vector<EvaluationPoint>& out) {
    family_ = cloud_.family(i);
    omega0_ = sum_V_ = surviving_ = 0;
    for (const int k : family_) {
      omega0_ += cloud_.omega(i, k) * cloud_.volume[k];
      sum_V_ += cloud_.volume[k];
      surviving_ += cloud_.intact(i, k) * cloud_.omega(i, k) * cloud_.volume[k];
    }
    if (description_.name == "conventional" && description_.cell > 0) {
      append_cell(i, out);
    } else if (description_.name == "conventional") {
      out.push_back({i, -1, point_weight(i), own_gradient(i)});
    } else if (description_.name == "sub_horizon") {
      append_parts(i, out);
    } else {
      for (const int j : family_)
        if (cloud_.intact(i, j) > 0) {
          out.push_back({i, j, bond_weight(i, j), bond_stencil(i, j)});
          if (description_.local_force) out.back().volume_share = domain_volume(i, j) / sum_V_;
        }
    }
  }

 private:
  /// W_i = V_i (1 - D_i): the intact omega0 is the reference, so a family degrades with its bonds.
  double point_weight(int i) const { return omega0_ > 0 ? cloud_.volume[i] * surviving_ / omega0_ : 0.0; }

  double bond_weight(int i, int j) const {
    const Weight weight = description_.weight.value_or(description_.name == "baqp" ? Weight::kernel : Weight::volume);
    const double w = weight == Weight::kernel ? cloud_.omega(i, j) * cloud_.volume[j] / omega0_ : cloud_.volume[j] / sum_V_;
    return cloud_.volume[i] * cloud_.intact(i, j) * w;
  }

  const Stencil& own_gradient(int i) {
    const auto [entry, fresh] = gradients_.try_emplace(i);
    if (fresh) entry->second = point_gradient(cloud_, i, description_.order, description_.singular);
    return entry->second;
  }

  /// The gradient of the fit at X_i +- s e_a, s^2 = d h^2/12, which have the second moments of a cube of width h.
  void append_cell(int i, std::vector<EvaluationPoint>& out) {
    const int d = cloud_.dimension;
    for (int a = 0; a < d; ++a)
      for (const double side : {1.0, -1.0}) {
        Vector x = Vector::Zero(d);
        x[a] = side * description_.cell * std::sqrt(d / 12.0);
        out.push_back({i, -1, point_weight(i) / (2 * d), fitted_gradient(i, x)});
      }
  }

  /// The gradient at X_i + x of the polynomial that fits the bonds best.
  Stencil fitted_gradient(int i, const Vector& x) const {
    for (int n = description_.order; n >= 1; --n) {
      const Eigen::Index size = monomials(x, n).size();
      Matrix M = Matrix::Zero(size, size);
      for (const int k : family_) {
        const Vector Q = monomials(cloud_.bond(i, k) / cloud_.horizon, n);
        M += cloud_.intact(i, k) * cloud_.omega(i, k) * cloud_.volume[k] * Q * Q.transpose();
      }
      const Vector values = Eigen::SelfAdjointEigenSolver<Matrix>(M).eigenvalues();
      if (!(values[size - 1] > 0) || values[0] < description_.singular * values[size - 1]) continue;
      const Matrix derivatives = monomial_derivatives(x / cloud_.horizon, n).transpose() / cloud_.horizon * M.inverse();
      Accumulator g;
      for (const int k : family_) {
        const Vector g_k = cloud_.intact(i, k) * cloud_.omega(i, k) * cloud_.volume[k] * derivatives * monomials(cloud_.bond(i, k) / cloud_.horizon, n);
        add(g, k, g_k);
        add(g, i, -g_k);
      }
      return finished(g);
    }
    return {};
  }

  void append_parts(int i, std::vector<EvaluationPoint>& out) {
    const int parts = description_.parts > 0 ? description_.parts : 1 << cloud_.dimension;
    const std::size_t first = out.size();
    const auto omega = [&](int k) { return cloud_.intact(i, k) * cloud_.omega(i, k); };
    const double limit = std::max(description_.poor, description_.part * eigenvalue_ratio(cloud_, i, family_, omega));
    double total = 0;
    for (int part = 0; part < parts; ++part) {
      double volume = 0;
      const auto in_part = [&](int k) { return share(cloud_.bond(i, k), cloud_.horizon, parts, part); };
      for (const int k : family_) volume += in_part(k) * cloud_.intact(i, k) * cloud_.volume[k];
      Stencil g = kernel_gradient(cloud_, i, 1, limit, family_, [&](int k) { return in_part(k) * omega(k); });
      if (g.empty()) continue;
      const double weight = description_.part_volumes ? volume : 1.0;
      total += weight;
      out.push_back({i, -1, weight, std::move(g)});
    }
    for (std::size_t q = first; q < out.size(); ++q) out[q].weight *= point_weight(i) / total;
    if (out.size() == first) out.push_back({i, -1, point_weight(i), own_gradient(i)});
  }

  Stencil bond_stencil(int i, int j) {
    if (description_.name == "baqp") return projected(i, j, own_gradient(i), own_gradient(j));
    if (description_.name == "projection") return projected(i, j, own_gradient(i), own_gradient(i));
    const auto omega = [&](int k) { return cloud_.intact(i, k) * cloud_.omega(i, k); };
    const double limit = description_.name == "bond_augmented"   // it holds the whole family
                             ? description_.singular
                             : std::max(description_.poor, description_.domain * eigenvalue_ratio(cloud_, i, family_, omega));
    Stencil g = kernel_gradient(cloud_, i, 1, limit, family_,
                                [&](int k) { return cloud_.intact(i, k) * bond_influence(i, j, k); });
    whole_ = g.empty();
    return whole_ ? own_gradient(i) : g;
  }

  /// Of the bond whose stencil was built last; bonds count by their share in the domain.
  double domain_volume(int i, int j) const {
    double volume = 0;
    for (const int k : family_)
      if (cloud_.omega(i, k) > 0) volume += cloud_.intact(i, k) * (whole_ ? 1.0 : bond_influence(i, j, k) / cloud_.omega(i, k)) * cloud_.volume[k];
    return volume;
  }

  /// omega(xi_ik, xi_ij) of the bond-level sums.
  double bond_influence(int i, int j, int k) const {
    const Vector xi = cloud_.bond(i, k), target = cloud_.bond(i, j);
    if (description_.name == "bond_associated") {
      const double radius = description_.bond_horizon_ratio * cloud_.horizon * (1 + 1e-10);
      return cloud_.bond(j, k).norm() <= radius ? cloud_.omega(i, k) : 0.0;
    }
    if (description_.name == "bond_augmented") return (k == j ? description_.lambda : 1.0) * cloud_.omega(i, k);
    if (description_.name == "non_spherical") {
      const double cosine = xi.dot(target) / (xi.norm() * target.norm());
      const double alignment = std::clamp(0.5 + 0.5 * cosine, 0.0, 1.0);
      return std::exp(-description_.n1 * std::abs(xi.norm() - target.norm()) / cloud_.horizon) *
             std::pow(alignment, description_.n2);
    }
    throw std::invalid_argument("no kinematics '" + description_.name + "'");
  }

  /// H = Ha (I - n (x) n) + u_ij (x) n / |xi|, Ha the mean of a and b; a dead end leaves Ha to the other one.
  Stencil projected(int i, int j, const Stencil& a, const Stencil& b) const {
    if (a.empty() && b.empty()) return {};
    Accumulator mean;
    add(mean, a, b.empty() ? 1.0 : 0.5);
    add(mean, b, a.empty() ? 1.0 : 0.5);
    const Vector xi = cloud_.bond(i, j), along = xi / xi.squaredNorm();
    Accumulator g;
    for (const auto& [k, g_k] : mean) add(g, k, g_k - g_k.dot(xi) * along);
    add(g, j, along);
    add(g, i, -along);
    return finished(g);
  }

  const Cloud& cloud_;
  const Description& description_;
  std::map<int, Stencil> gradients_;
  std::vector<int> family_;
  double omega0_ = 0, sum_V_ = 0, surviving_ = 0;
  bool whole_ = false;
};

}  // namespace

std::vector<int> Cloud::family(int i) const {
  std::vector<int> members;
  for (int j = 0; j < points(); ++j)
    if (j != i && bond(i, j).norm() <= horizon * (1 + 1e-10)) members.push_back(j);
  return members;
}

Stencil point_gradient(const Cloud& cloud, int i, int order, double singular) {
  const std::vector<int> family = cloud.family(i);
  Stencil g;
  for (int n = order; n >= 1 && g.empty(); --n)
    g = kernel_gradient(cloud, i, n, singular, family, [&](int k) { return cloud.intact(i, k) * cloud.omega(i, k); });
  return g;
}

Matrix polynomial_fit(const Cloud& cloud, int i, int order, double singular) {
  const std::vector<int> family = cloud.family(i);
  for (int n = order; n >= 1 && !family.empty(); --n) {
    Matrix Q(static_cast<Eigen::Index>(family.size()), monomials(cloud.bond(i, family.front()), n).size());
    Vector weight(Q.rows());
    for (Eigen::Index k = 0; k < Q.rows(); ++k) {
      const int j = family[static_cast<std::size_t>(k)];
      Q.row(k) = monomials(cloud.bond(i, j) / cloud.horizon, n).transpose();
      weight[k] = cloud.intact(i, j) * cloud.omega(i, j) * cloud.volume[j];
    }
    const Matrix moment = Q.transpose() * weight.asDiagonal() * Q;
    const Vector values = Eigen::SelfAdjointEigenSolver<Matrix>(moment).eigenvalues();
    if (values[values.size() - 1] > 0 && values[0] >= singular * values[values.size() - 1]) return Q * moment.inverse() * Q.transpose() * weight.asDiagonal();
  }
  return {};
}

Operator build(const Cloud& cloud, const Description& description, const std::vector<int>& owners) {
  Operator result{cloud.dimension, cloud.points(), {}, {}, {}, {}};
  std::vector<int> chosen = owners;
  if (owners.empty())
    for (int i = 0; i < cloud.points(); ++i) chosen.push_back(i);

  if (description.name == "selective") {
    Description base = description.base ? *description.base : Description{.name = "bond_associated"};
    base.local_force = base.local_force || description.local_force;
    result = build(cloud, base, owners);
    result.owner_gradient.resize(cloud.points());
    const int order = description.base ? description.base->order : 1;
    result.owner_share.resize(cloud.points());
    for (const int i : chosen) {
      result.owner_gradient[i] = point_gradient(cloud, i, order, description.singular);
      double first = 0, left = 0;
      for (const int k : cloud.family(i)) {
        const double influence = cloud.omega(i, k) * cloud.volume[k];
        left += cloud.intact(i, k) * influence;
        first += (cloud.failed ? 1.0 : cloud.intact(i, k)) * influence;
      }
      result.owner_share[i] = first > 0 ? left / first : 1.0;
    }
    return result;
  }
  Builder builder(cloud, description);
  for (const int i : chosen) builder.append(i, result.q);
  if (description.local_force) result.owner_volume = cloud.volume;
  return result;
}

}  // namespace perikit::reference
