#pragma once
/// Point gradients on a cloud and their adjoint, one point at a time over its sorted neighbours. Rows run over displacement components:
/// H[D p + e][c] = H_ce.
///
///   order 1:   S = sum_j omega V_j u_ij (x) xi_ij,  H = S K^-1;   f_i = sum_j omega xi_ij (V_j Q_i + V_i Q_j),  Q = P K^-1
///   order 2+:  H = sum_j u_ij (x) g_ij with stored g;             f_i += P_i g_ij,  f_j -= P_i g_ij
///
/// Order 1 may be shifted by a field lambda: g_ij = omega V_j (M_i xi_ij + lambda_ij), M_i = K_i^-1 - (sum_k lambda_ik (x) omega
/// V_k K_i^-1 xi_ik), as exact for affine motion as without (spaces/shift.hpp). Then H_ce = sum_b S_cb M_eb + T_ce, T = sum_j
/// omega V_j u_ij (x) lambda_ij, Q_cb = P_ce M_eb, and f_i += sum_j omega lambda_ij (V_j P_i + V_i P_j).

#include <cmath>

#include "families/cloud/cloud_families.hpp"
#include "families/cloud/cloud_row_simd.hpp"
#include "families/cloud/cloud_rows.hpp"
#include "families/shape_tensor.hpp"

namespace perikit {

template <int D>
class CloudGradient {
 public:
  explicit CloudGradient(const CloudFamilies& families, int order = 1)
      : families_(families), position_(reinterpret_cast<const Row*>(families.body().rows().data())), order_(order) {
    if (order > 1) store_stencils();
  }

  bool stored() const noexcept { return order_ > 1; }
  /// H of point p.
  void at(std::size_t p, const AlignedVector<Row>& u, Row* H) const noexcept {
    if (!stored()) {
      Row S[D];
      if (shifted() && live(p)) {
        Row T[D];
        moments<true>(p, u, S, T);
        times_inverse(p, S, H);
        for (int e = 0; e < D; ++e) H[e] += T[e];
        return;
      }
      moments<false>(p, u, S, nullptr);
      return times_inverse(p, S, H);
    }
    Row h[D] = {};
    for (std::int64_t k = lists().first[p]; k < lists().first[p + 1]; ++k) {
      const Row du = u[static_cast<std::size_t>(lists().neighbour[static_cast<std::size_t>(k)])] - u[p];
      for (int e = 0; e < D; ++e) h[e] += stencil_[static_cast<std::size_t>(k * D + e)] * du;
    }
    for (int e = 0; e < D; ++e) H[e] = h[e];
  }
  /// Q = S K^-1; Q may be S.
  void times_inverse(std::size_t p, const Row* S, Row* Q) const noexcept {
    if (shifted())
      return times(
          S, Q, [&](int k, int e) { return matrix_[(p * D + static_cast<std::size_t>(e)) * D + static_cast<std::size_t>(k)]; });
    const double* inverse = families_.inverse_shape(p);
    times(S, Q, [&](int k, int e) { return inverse[symmetric_index(D, k, e)]; });
  }
  /// Q = S M, for stresses; Q may be S.
  void times_transposed(std::size_t p, const Row* S, Row* Q) const noexcept {
    if (!shifted()) return times_inverse(p, S, Q);
    times(S, Q, [&](int k, int e) { return matrix_[(p * D + static_cast<std::size_t>(k)) * D + static_cast<std::size_t>(e)]; });
  }
  /// Order 1: from now on with this field, which must outlive the gradients.
  void shift(ConstFieldView lambda) {
    mirror_rows(lambda, families_.body().points(), lambda_);
    matrix_.assign(D * D * families_.body().points(), 0.0);
    for (std::size_t p = 0; p < families_.body().points(); ++p) shift_point(p);
  }
  bool shifted() const noexcept { return !lambda_.empty(); }
  /// Shifted gradients: the stress P of p as `divergence` wants it, zero where there is no gradient.
  void keep_stress(std::size_t p, const Row* P, Row* kept) const noexcept {
    for (int e = 0; e < D; ++e) kept[e] = live(p) ? P[e] : Row{};
  }
  /// Order 1: f, and what Q of all points adds to the force on p; where gradients are shifted, with what their stresses P add beside that.
  Row divergence(std::size_t p, const AlignedVector<Row>& Q, const AlignedVector<Row>& P, Row f = Row{}) const noexcept {
    return shifted() ? divergence<true>(p, Q.data(), P.data(), f) : divergence<false>(p, Q.data(), nullptr, f);
  }
  /// Stored stencils: what the stress S on H of point p does, added to force.
  void scatter(std::size_t p, const Row* S, AlignedVector<Row>& force) const noexcept {
    Row own{};
    for (std::int64_t k = lists().first[p]; k < lists().first[p + 1]; ++k) {
      Row t{};
      for (int e = 0; e < D; ++e) t += stencil_[static_cast<std::size_t>(k * D + e)] * S[e];
      own += t;
      force[static_cast<std::size_t>(lists().neighbour[static_cast<std::size_t>(k)])] -= t;
    }
    force[p] += own;
  }
  /// The bonds of p have changed.
  void renew(std::size_t p) {
    if (stored()) store_stencil(p);
    if (shifted()) shift_point(p);
  }
  /// Points of a lower order than asked for, at the set-up.
  std::size_t fallbacks() const noexcept { return fallbacks_; }
  std::size_t bytes() const noexcept {
    return (stencil_.size() + matrix_.size()) * sizeof(double) + lambda_.size() * sizeof(Row);
  }

 private:
  template <class Entry>
  static void times(const Row* S, Row* Q, Entry&& entry) noexcept {
    Row out[D];
    for (int e = 0; e < D; ++e) {
      out[e] = Row{};
      for (int k = 0; k < D; ++k) out[e] += entry(k, e) * S[k];
    }
    for (int e = 0; e < D; ++e) Q[e] = out[e];
  }
  bool live(std::size_t p) const noexcept { return std::isfinite(families_.condition(p)); }
  /// M_eb = K^-1_eb - (gradient of lambda)_eb.
  void shift_point(std::size_t p) noexcept {
    Row L[D], H[D];
    moments<false>(p, lambda_, L, nullptr);
    const double* inverse = families_.inverse_shape(p);
    times(L, H, [&](int k, int e) { return inverse[symmetric_index(D, k, e)]; });
    for (int e = 0; e < D; ++e)
      for (int b = 0; b < D; ++b)
        matrix_[(p * D + static_cast<std::size_t>(e)) * D + static_cast<std::size_t>(b)] =
            live(p) ? inverse[symmetric_index(D, e, b)] - H[b][e] : 0.0;
  }
  const FamilyLists& lists() const noexcept { return families_.lists(); }
  /// S = sum_j omega V_j u_ij (x) xi_ij, and where `shift` T = sum_j omega V_j u_ij (x) lambda_ij.
  template <bool shift>
  void moments(std::size_t p, const AlignedVector<Row>& field, Row* S, [[maybe_unused]] Row* T) const noexcept {
    const Row *const position = position_, *const u = field.data(), *const lambda = lambda_.data();
    const TwoRows x = TwoRows::load(position[p], position[p]), own = TwoRows::load(u[p], u[p]);
    TwoRows s[D], t[D], own_lambda;
    if constexpr (shift) own_lambda = TwoRows::load(lambda[p], lambda[p]);
    over_bonds(families_, p, [&](std::size_t j, std::size_t l, const TwoRows& omega) PERIKIT_INLINE {
      const TwoRows far = TwoRows::load(position[j], position[l]);
      const TwoRows du = omega * far.spread<3>() * (TwoRows::load(u[j], u[l]) - own);
      const auto add = [&](const TwoRows& d, TwoRows(&to)[D]) PERIKIT_INLINE {
        over_components<D>([&](auto e) PERIKIT_INLINE { to[e].add_product(d.template spread<e>(), du); });
      };
      add(far - x, s);
      if constexpr (shift) add(TwoRows::load(lambda[j], lambda[l]) - own_lambda, t);
    });
    for (int e = 0; e < D; ++e) {
      S[e] = s[e].sum();
      if constexpr (shift) T[e] = t[e].sum();
    }
  }
  template <bool shift>
  Row divergence(std::size_t p, const Row* Q, [[maybe_unused]] const Row* P, Row f) const noexcept {
    // f_i = sum_j omega xi_ij (V_j Q_i + V_i Q_j) = Q_i m + V_i sum_j (omega xi_ij) Q_j, m = sum_j V_j omega xi_ij
    const Row *const position = position_, *const lambda = lambda_.data();
    const TwoRows x = TwoRows::load(position[p], position[p]);
    TwoRows sum[D], m, m_lambda, own_lambda;
    if constexpr (shift) own_lambda = TwoRows::load(lambda[p], lambda[p]);
    over_bonds(families_, p, [&](std::size_t j, std::size_t l, const TwoRows& omega) PERIKIT_INLINE {
      const TwoRows far = TwoRows::load(position[j], position[l]), volume = far.spread<3>();
      const auto add = [&](const TwoRows& d, const Row* stress, TwoRows& moment) PERIKIT_INLINE {
        over_components<D>([&](auto e) PERIKIT_INLINE { sum[e].add_product(d.template spread<e>(), TwoRows::load(stress[D * j + e], stress[D * l + e])); });
        moment.add_product(volume, d);
      };
      add(omega * (far - x), Q, m);
      if constexpr (shift) add(omega * (TwoRows::load(lambda[j], lambda[l]) - own_lambda), P, m_lambda);
    });
    Row far_sum{};
    for (int e = 0; e < D; ++e) far_sum += sum[e].sum();
    f += position[p][3] * far_sum;
    const auto add_own = [&](const Row& moment, const Row* stress) {
      for (int e = 0; e < D; ++e) f += moment[e] * stress[D * p + static_cast<std::size_t>(e)];
    };
    add_own(m.sum(), Q);
    if constexpr (shift) add_own(m_lambda.sum(), P);
    return f;
  }
  void store_stencils();
  /// Whether it has a lower order.
  bool store_stencil(std::size_t p);

  const CloudFamilies& families_;
  const Row* position_;                  ///< {x, y, z, V}
  int order_;
  AlignedVector<double> stencil_;  ///< g[D * bond + e]
  AlignedVector<Row> lambda_;      ///< by point; empty: not shifted
  AlignedVector<double> matrix_;   ///< M by point, row-major
  std::size_t fallbacks_ = 0;
};

}  // namespace perikit
