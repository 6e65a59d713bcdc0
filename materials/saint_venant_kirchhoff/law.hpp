#pragma once

#include "perikit/core/tensor.hpp"
#include "perikit/model/elastic_constants.hpp"
#include "perikit/sdk/free_stretch.hpp"

namespace perikit {

/// Saint Venant-Kirchhoff solid: second Piola-Kirchhoff stress linear in the Green-Lagrange strain.
///   psi = lambda/2 (tr E)^2 + mu E:E,  E = (F^T F - I)/2,  S = lambda tr(E) I + 2 mu E,  P = F S
struct SaintVenantKirchhoff {
  static constexpr MaterialTraits traits{.constants = 2, .green_linear = true};

  void constants(const MaterialInput& input, double* k) const {
    const Moduli moduli = elastic_constants(input);
    k[0] = moduli.lambda;
    k[1] = moduli.mu;
  }
  Moduli small_strain(const double* k) const noexcept { return {k[0], k[1]}; }

  template <class T, class S, class K>
  T psi(const Tensor<T, S>& H, const K& k) const noexcept {
    const auto& [lambda, mu] = k;
    const Tensor<T, S> c = right_cauchy_green_minus_identity(H);  // 2 E
    const T t = trace(c);
    return 0.125 * lambda * (t * t) + 0.25 * mu * inner(c, c);
  }

  template <class T, class S, class K>
  Tensor<T, S> P(const Tensor<T, S>& H, const K& k) const noexcept {
    const auto& [lambda, mu] = k;
    const Tensor<T, S> c = right_cauchy_green_minus_identity(H);
    const T mean = (0.5 * lambda) * trace(c);
    const Tensor<T, S> second = Tensor<T, S>::map([&, &mu = mu](int k) { return row<S>(k) == column<S>(k) ? T(mu * c[k] + mean) : T(mu * c[k]); });
    return second + H * second;
  }

  /// S33 = 0 is linear in C - I: C33 - 1 = -lambda/(lambda + 2 mu) tr (C - I over the plane), in a bar -lambda/(2 (lambda + mu))
  /// (C11 - 1).
  template <class S, class K>
  K free_constants(const K& k) const noexcept {
    return free_lame<S>(k);
  }
  /// C33 > 0.
  template <class T, class S, class K>
  auto stretches_freely(const Tensor<T, S>& H, const K& k) const noexcept {
    const auto& [lambda, mu] = k;
    return lambda * given_strain(H) < free_modulus<S>(lambda, mu);
  }
  template <class T, class S, class K>
  T free_stretch(const Tensor<T, S>& H, const K& k) const noexcept {
    const auto& [lambda, mu] = k;
    const T square = -lambda / free_modulus<S>(lambda, mu) * given_strain(H);
    return square / (1.0 + sqrt(1.0 + square));
  }

 private:
  /// tr(C - I) over the body's space.
  template <class T, class S>
  static T given_strain(const Tensor<T, S>& H) noexcept {
    const Tensor<T, S> c = right_cauchy_green_minus_identity(H);
    T sum = c(0, 0);
    for (int i = 1; i < S::dimension; ++i) sum += c(i, i);
    return sum;
  }
};

}  // namespace perikit
