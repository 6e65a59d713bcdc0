#pragma once

#include <array>

#include "perikit/core/spectral.hpp"
#include "perikit/model/elastic_constants.hpp"
#include "perikit/sdk/free_stretch.hpp"
#include "perikit/sdk/volumetric.hpp"

namespace perikit {

/// Hencky solid: Kirchhoff stress linear in the logarithmic strain [Hashim et al., eqs. 4-8].
///   psi = lambda/2 (ln J)^2 + mu h:h,  h = ln(F F^T)/2,  tau = lambda ln J I + 2 mu h,  P = tau F^-T
/// Logarithms of the eigenvalues of F F^T - I through log1p; derivatives by divided differences of the logarithm in a form that
/// is exact for equal and for nearly equal principal stretches.
struct Hencky {
  static constexpr MaterialTraits traits{.constants = 2};

  void constants(const MaterialInput& input, double* k) const {
    const Moduli moduli = elastic_constants(input);
    k[0] = moduli.lambda;
    k[1] = moduli.mu;
  }
  Moduli small_strain(const double* k) const noexcept { return {k[0], k[1]}; }

  template <class T, class S, class K>
  T psi(const Tensor<T, S>& H, const K& k) const noexcept {
    const auto& [lambda, mu] = k;
    const Spectral<T, S> e = spectral(left_cauchy_green_minus_identity(H));
    const T volume = log1p(jacobian_minus_one(H));
    const T l0 = log1p(e.values[0]), l1 = log1p(e.values[1]), l2 = log1p(e.values[2]);
    return 0.5 * lambda * (volume * volume) + 0.25 * mu * (l0 * l0 + l1 * l1 + l2 * l2);
  }

  template <class T, class S, class K>
  Tensor<T, S> P(const Tensor<T, S>& H, const K& k) const noexcept {
    const Spectral<T, S> e = spectral(left_cauchy_green_minus_identity(H));
    return kirchhoff(e, H, k) * inverse_transpose(H);
  }

  template <class T, class S, class K>
  auto tangent(const Tensor<T, S>& H, const K& k) const noexcept {
    const Spectral<T, S> e = spectral(left_cauchy_green_minus_identity(H));
    const Tensor<T, S> G = inverse_transpose(H), P = kirchhoff(e, H, k) * G;
    const Tensor<T, S> slopes = Tensor<T, S>::build_symmetric([&](int i, int j) { return log_slope(e.values[i], e.values[j]); });
    return [=](const Tensor<T, S>& dH) {
      const auto& [lambda, mu] = k;
      const Tensor<T, S> half = dH + dH * transpose(H);  // dH F^T
      const Tensor<T, S> turned = rotate(transpose(e.vectors), symmetric_part(half));
      const Tensor<T, S> log_change = Tensor<T, S>::map([&](int c) { return slopes[c] * turned[c]; });
      const Tensor<T, S> dtau = add_diagonal((2.0 * mu) * rotate(e.vectors, log_change), lambda * inner(G, dH));
      return (dtau - P * transpose(dH)) * G;
    };
  }

  /// psi = mu dev h : dev h + kappa/2 (ln J)^2
  template <class K>
  std::array<K, 2> isochoric(const std::array<K, 2>& k) const noexcept {
    return {-2.0 / 3 * k[1], k[1]};
  }
  template <class T, class K>
  VolumeResponse<T> volume(const T& j, const K& k) const noexcept {
    return volume_response(Volumetric::logarithmic, k[0] + 2.0 / 3 * k[1], j);
  }

  /// tau33 = 0 is linear in logarithms: ln(free stretch) = -lambda/(lambda + 2 mu) ln J over the plane, in a bar -lambda/(2
  /// (lambda + mu)) ln F11.
  template <class S, class K>
  K free_constants(const K& k) const noexcept {
    return free_lame<S>(k);
  }
  template <class T, class S, class K>
  T free_stretch(const Tensor<T, S>& H, const K& k) const noexcept {
    const auto& [lambda, mu] = k;
    return expm1(-lambda / free_modulus<S>(lambda, mu) * log1p(jacobian_minus_one(H)));
  }

 private:
  /// (log1p(a) - log1p(b))/(a - b), its limit 1/(1 + a) where they are equal.
  template <class T>
  static T log_slope(const T& a, const T& b) noexcept {
    const T low = min(a, b), x = abs(a - b) / (1.0 + low);  // (1 + high)/(1 + low) = 1 + x
    const T ratio = log1p(x) / select(x > T(0.0), x, T(1.0));
    return select(x > T(0.0), ratio, T(1.0)) / (1.0 + low);
  }

  /// F^-T = (I + G)/J.
  template <class T, class S>
  static Tensor<T, S> inverse_transpose(const Tensor<T, S>& H) noexcept {
    return (T(1.0) / (1.0 + jacobian_minus_one(H))) * add_diagonal(cofactor_minus_identity(H), T(1.0));
  }

  template <class T, class S, class K>
  static Tensor<T, S> kirchhoff(const Spectral<T, S>& e, const Tensor<T, S>& H, const K& k) noexcept {
    const auto& [lambda, mu] = k;
    const T logs[3] = {log1p(e.values[0]), log1p(e.values[1]), log1p(e.values[2])};
    return add_diagonal(mu * compose(e.vectors, logs), lambda * log1p(jacobian_minus_one(H)));
  }
};

}  // namespace perikit
