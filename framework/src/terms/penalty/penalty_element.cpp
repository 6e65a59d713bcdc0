#include "terms/penalty/penalty_element.hpp"

#include <algorithm>

#include "families/reproducing_kernel.hpp"
#include "families/shape_tensor.hpp"
#include "terms/family_point.hpp"
#include "terms/penalty/penalty_matrix.hpp"

namespace perikit {

template <int D>
bool PenaltyElement<D>::load(const PenaltyParts& parts, std::size_t point) {
  const Families& families = parts.families;
  families.load(point, BondsOf::set_up, family_);
  if (family_.inverse_shape[0] == 0) return false;
  const int order = point_gradient(family_, families.body().horizon(), parts.formulation.order, gradient_);
  if (order == 0) return false;
  volume_ = families.body().volume(point);
  double intact = 0, M[6], K[6];
  spring_.resize(family_.far.size());
  for (auto& row : S_) std::fill_n(row, D, 0.0);
  for (std::size_t k = 0; k < spring_.size(); ++k) {
    const double w = family_.omega[k] * family_.volume[k];
    intact += w;
    spring_[k] = volume_ * w;
    for (int e = 0; e < D; ++e)
      for (int f = 0; f < D; ++f) S_[e][f] += spring_[k] * family_.xi[e][k] * family_.xi[f][k];
  }
  for (int e = 0; e < D; ++e)
    for (int f = e; f < D; ++f) K[symmetric_index(D, e, f)] = S_[e][f];
  if (!penalised(1 / eigenvalue_ratio(D, K))) return false;
  parts.stabilization->penalty(penalty_point(families, parts.laws, point, intact, family_.inverse_shape), M);
  polynomials_ = whole_fit(parts) ? orthonormal_polynomials(family_, families.body().horizon(), order, polynomial_) : 0;
  const bool isotropic = parts.stabilization->traits().isotropic;
  for (int a = 0; a < D; ++a)
    for (int b = 0; b < D; ++b) M_[a][b] = isotropic ? (a == b ? M[0] : 0.0) : M[symmetric_index(D, a, b)];
  return true;
}

template <int D>
void PenaltyElement<D>::form_whole(std::size_t own, std::vector<double>& N) const {
  const std::size_t nodes = spring_.size() + 1, count = polynomials_;
  N.assign(nodes * nodes, 0.0);
  std::vector<double> p(nodes * count, 0.0);
  for (std::size_t k = 0; k < spring_.size(); ++k) {
    const std::size_t at = k < own ? k : k + 1;
    const double w = spring_[k] / volume_;
    for (std::size_t a = 0; a < count; ++a) {
      p[at * count + a] = w * polynomial(k, a);
      p[own * count + a] -= p[at * count + a];
    }
    N[at * nodes + at] += spring_[k];
    N[own * nodes + own] += spring_[k];
    N[at * nodes + own] -= spring_[k];
    N[own * nodes + at] -= spring_[k];
  }
  for (std::size_t k = 0; k < nodes; ++k)
    for (std::size_t l = 0; l < nodes; ++l) {
      double sum = 0;
      for (std::size_t a = 0; a < count; ++a) sum += p[k * count + a] * p[l * count + a];
      N[k * nodes + l] -= volume_ * sum;
    }
}

template <int D>
void PenaltyElement<D>::form(std::size_t own, std::vector<double>& N) const {
  if (polynomials_ > 0) return form_whole(own, N);
  struct Node {
    double p[D], g[D];
  };
  const std::size_t nodes = spring_.size() + 1;
  std::vector<Node> node(nodes, Node{});
  N.assign(nodes * nodes, 0.0);
  for (std::size_t k = 0; k < spring_.size(); ++k) {
    const std::size_t at = k < own ? k : k + 1;
    for (std::size_t e = 0; e < D; ++e) {
      node[at].p[e] = spring_[k] * family_.xi[e][k];
      node[at].g[e] = gradient_[k * D + e];
      node[own].p[e] -= node[at].p[e];
      node[own].g[e] -= node[at].g[e];
    }
    N[at * nodes + at] += spring_[k];
    N[own * nodes + own] += spring_[k];
    N[at * nodes + own] -= spring_[k];
    N[own * nodes + at] -= spring_[k];
  }
  for (std::size_t k = 0; k < nodes; ++k) {
    Node row;  // against p and g of l: -g_k and S g_k - p_k
    for (int e = 0; e < D; ++e) {
      row.p[e] = -node[k].g[e];
      row.g[e] = -node[k].p[e];
      for (int f = 0; f < D; ++f) row.g[e] += S_[e][f] * node[k].g[f];
    }
    for (std::size_t l = 0; l < nodes; ++l)
      for (int e = 0; e < D; ++e) N[k * nodes + l] += row.p[e] * node[l].p[e] + row.g[e] * node[l].g[e];
  }
}

template class PenaltyElement<1>;
template class PenaltyElement<2>;
template class PenaltyElement<3>;

}  // namespace perikit
