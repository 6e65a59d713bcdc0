#include "assembly/penalty_element.hpp"

#include <algorithm>

#include "families/family_point.hpp"
#include "terms/penalty_matrix.hpp"

namespace perikit {

template <int D>
bool PenaltyElement<D>::load(const ModelParts& parts, const PointFamilies& families, std::size_t row) {
  families.load(row, family_);
  if (family_.inverse_shape[0] == 0) return false;
  const int order = parts.formulation.order;
  gradient_.clear();
  if (order > 1 && !point_gradient(family_, parts.body->horizon(), order, gradient_)) return false;
  const auto bonds = static_cast<std::size_t>(family_.bonds);
  double intact = 0, M[6];
  spring_.resize(bonds);
  for (auto& row : S_) std::fill_n(row, D, 0.0);
  for (std::size_t k = 0; k < bonds; ++k) {
    const double w = family_.omega[k] * family_.volume[k];
    intact += w;
    spring_[k] = families.volume(row) * w;
    for (int e = 0; e < D; ++e)
      for (int f = 0; f < D; ++f) S_[e][f] += spring_[k] * family_.xi[e][k] * family_.xi[f][k];
  }
  double K[6];
  for (int e = 0; e < D; ++e)
    for (int f = e; f < D; ++f) K[symmetric_index(D, e, f)] = S_[e][f];
  if (!penalised(1 / eigenvalue_ratio(D, K))) return false;
  const PenaltyPoint point = penalty_point(*parts.body, *parts.laws, families.point(row), intact, families.damage(row),
                                           families.normaliser(row), family_.inverse_shape);
  parts.stabilization->penalty(point, M);
  const bool isotropic = parts.stabilization->traits().isotropic;
  for (int a = 0; a < D; ++a)
    for (int b = 0; b < D; ++b) M_[a][b] = isotropic ? (a == b ? M[0] : 0.0) : M[symmetric_index(D, a, b)];
  return true;
}

template <int D>
void PenaltyElement<D>::subtract_seen(double* A) const noexcept {
  if (!gradient_.empty()) return;
  for (int a = 0; a < D; ++a)
    for (int e = 0; e < D; ++e)
      for (int b = 0; b < D; ++b)
        for (int f = 0; f < D; ++f) A[(a * D + e) * D * D + b * D + f] -= M_[a][b] * S_[e][f];
}

// N = -(p g^T + g p^T) + g S g^T with p_k = w_k xi_k.
template <int D>
void PenaltyElement<D>::add_higher_order(std::size_t own, std::size_t width) {
  const std::size_t nodes = spring_.size() + 1;
  node_.assign(nodes * 2 * D, 0.0);
  const auto p = [&](std::size_t node) { return node_.data() + node * 2 * D; };
  for (std::size_t k = 0; k < spring_.size(); ++k)
    for (std::size_t e = 0; e < D; ++e) {
      double* to = p(k < own ? k : k + 1);
      to[e] = spring_[k] * family_.xi[e][k];
      to[D + e] = gradient_[k * D + e];
      p(own)[e] -= to[e];
      p(own)[D + e] -= to[D + e];
    }
  seen_.assign(width * width, 0.0);
  for (std::size_t k = 0; k < nodes; ++k) {
    double row[2 * D];  // of p and g, against those of l: -g_k and S g_k - p_k
    for (int e = 0; e < D; ++e) {
      row[e] = -p(k)[D + e];
      row[D + e] = -p(k)[e];
      for (int f = 0; f < D; ++f) row[D + e] += S_[e][f] * p(k)[D + f];
    }
    for (std::size_t l = 0; l < nodes; ++l)
      for (std::size_t e = 0; e < 2 * D; ++e) seen_[k * width + l] += row[e] * p(l)[e];
  }
}

template <int D>
void PenaltyElement<D>::add_springs(std::size_t own, std::size_t width, double* K) {
  if (!gradient_.empty()) add_higher_order(own, width);
  for (int a = 0; a < D; ++a)
    for (int b = 0; b < D; ++b) {
      double* block = K + static_cast<std::size_t>(a * D + b) * width * width;
      for (std::size_t k = 0; k < spring_.size(); ++k) {
        const std::size_t node = k < own ? k : k + 1;
        const double s = M_[a][b] * spring_[k];
        block[node * width + node] += s;
        block[own * width + own] += s;
        block[node * width + own] -= s;
        block[own * width + node] -= s;
      }
      for (std::size_t i = 0; i < width * width && !gradient_.empty(); ++i) block[i] += M_[a][b] * seen_[i];
    }
}

template class PenaltyElement<1>;
template class PenaltyElement<2>;
template class PenaltyElement<3>;

}  // namespace perikit
