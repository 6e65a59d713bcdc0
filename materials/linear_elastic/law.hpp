#pragma once

#include "perikit/core/tensor.hpp"
#include "perikit/model/elastic_constants.hpp"
#include "perikit/sdk/free_stretch.hpp"

namespace perikit {

/// Small-strain isotropic elasticity.
///   psi = lambda/2 (tr e)^2 + mu e:e,  e = (H + H^T)/2,  P = lambda tr(e) I + 2 mu e
struct LinearElastic {
  static constexpr MaterialTraits traits{.constants = 2, .constant_tangent = true, .objective = false};

  void constants(const MaterialInput& input, double* k) const {
    const Moduli moduli = elastic_constants(input);
    k[0] = moduli.lambda;
    k[1] = moduli.mu;
  }
  Moduli small_strain(const double* k) const noexcept { return {k[0], k[1]}; }

  template <class T, class S, class K>
  T psi(const Tensor<T, S>& H, const K& k) const noexcept {
    const auto& [lambda, mu] = k;
    const Tensor<T, S> e = symmetric_part(H);
    const T t = trace(e);
    return 0.5 * lambda * (t * t) + mu * inner(e, e);
  }

  template <class T, class S, class K>
  Tensor<T, S> P(const Tensor<T, S>& H, const K& k) const noexcept {
    const auto& [lambda, mu] = k;
    return add_diagonal((2.0 * mu) * symmetric_part(H), lambda * trace(H));
  }

  template <class T, class S, class K>
  auto tangent(const Tensor<T, S>&, const K& k) const noexcept {
    return [this, k](const Tensor<T, S>& dH) { return P(dH, k); };
  }

  /// P33 = 0 is linear in H.
  template <class S, class K>
  K free_constants(const K& k) const noexcept {
    return free_lame<S>(k);
  }
  template <class T, class S, class K>
  T free_stretch(const Tensor<T, S>& H, const K& k) const noexcept {
    const auto& [lambda, mu] = k;
    T plane = 0.0;
    for (int i = 0; i < S::dimension; ++i) plane += H(i, i);
    return -lambda / free_modulus<S>(lambda, mu) * plane;
  }
};

}  // namespace perikit
