#pragma once

#include "perikit/core/tensor.hpp"
#include "perikit/model/elastic_constants.hpp"
#include "perikit/sdk/rubber_free_stress.hpp"
#include "perikit/sdk/volumetric.hpp"

namespace perikit {

/// Compressible neo-Hookean rubber [Scabbia et al. 2025, eq. 5].
///   psi = mu/2 (J^(-2/3) tr C - 3) + psi_vol(kappa, J)
///   P = mu J^(-2/3) (F - tr(C)/3 F^-T) + J psi_vol'(J) F^-T
/// Written in H = F - I with m = tr(C - I)/3: F - tr(C)/3 F^-T = (F - F^-T) - m F^-T, every term of the order of H.
struct NeoHookean {
  static constexpr MaterialTraits traits{.constants = 2};
  Volumetric volumetric = Volumetric::quadratic;

  void constants(const MaterialInput& input, double* k) const {
    const Moduli moduli = elastic_constants(input);
    k[0] = moduli.mu;
    k[1] = moduli.bulk();
  }
  Moduli small_strain(const double* k) const noexcept { return {k[1] - 2 * k[0] / 3, k[0]}; }

  /// tr(C)/3 - 1.
  template <class T, class S>
  static T mean_strain(const Tensor<T, S>& H) noexcept {
    return (2.0 * trace(H) + inner(H, H)) * (1.0 / 3.0);
  }

  template <class T, class S, class K>
  T psi(const Tensor<T, S>& H, const K& k) const noexcept {
    const auto& [mu, kappa] = k;
    // tr C / J^(2/3) = 3 s with s = (1 + m) J^(-2/3), and s^-3 = 1 + w with w of second order in the deviator d of C - I:
    // w = I2(d)/(1 + m)^2 + det(d)/(1 + m)^3. So 3 s - 3 = -3 w s^3 / (1 + s + s^2) keeps its digits.
    const T m = mean_strain(H), j = jacobian_minus_one(H), root = reciprocal_cbrt(T(1.0 + j)), scale = root * root, s = scale * (1.0 + m);
    const Tensor<T, S> d = deviator(right_cauchy_green_minus_identity(H));
    const T second = second_invariant(d) * (scale * scale), third = determinant(d) * (scale * scale * scale);
    return -1.5 * mu * ((second * s + third) / (1.0 + s * (1.0 + s))) + volumetric_energy(volumetric, kappa, j);
  }

  template <class T, class S, class K>
  Tensor<T, S> P(const Tensor<T, S>& H, const K& k) const noexcept {
    const auto& [mu, kappa] = k;
    const T j = jacobian_minus_one(H), root = reciprocal_cbrt(T(1.0 + j)), shear = mu * (root * root);
    const T pressure = volumetric_kirchhoff(volumetric, kappa, j) - shear * mean_strain(H);
    return two_term_stress(shear, pressure, H, cofactor_minus_identity(H), j, T(root * (root * root)));
  }

  /// With P = a F + c F^-T, a = mu J^(-2/3), c = J psi_vol' - a (1 + m):
  ///   dP = a dF - c F^-T dF^T F^-T + da F + dc F^-T,  da/a = -2/3 dJ/J,  dJ/J = F^-T : dF,  dm = 2/3 F : dF
  template <class T, class S, class K>
  auto tangent(const Tensor<T, S>& H, const K& k) const noexcept {
    const auto& [mu, kappa] = k;
    const T m = mean_strain(H), j = jacobian_minus_one(H), root = reciprocal_cbrt(T(1.0 + j)), a = mu * (root * root);
    const T c = volumetric_kirchhoff(volumetric, kappa, j) - a * (1.0 + m);
    const T c_by_volume = volumetric_kirchhoff_slope(volumetric, kappa, j) + (2.0 / 3) * a * (1.0 + m);  // dc for dJ/J = 1
    const Tensor<T, S> F = add_diagonal(H, T(1.0)),
                       G = (root * (root * root)) * add_diagonal(cofactor_minus_identity(H), T(1.0));  // F^-T
    return [=](const Tensor<T, S>& dH) {
      const T volume = inner(G, dH), shape = T(2.0 / 3) * a * inner(F, dH);
      const Tensor<T, S> turned = G * (transpose_times(dH, G));
      return a * dH + (T(-2.0 / 3) * a * volume) * F + (c_by_volume * volume - shape) * G - c * turned;
    };
  }

  template <class T, class S, class K>
  auto free_stress(const Tensor<T, S>& H, const K& k) const noexcept {
    const auto& [mu, kappa] = k;
    return RubberFreeStress<T, S>(H, T(0.5 * mu), T(0.0), T(kappa), volumetric);
  }
};

}  // namespace perikit
