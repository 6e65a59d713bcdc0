#pragma once

#include <array>

#include "perikit/core/tensor.hpp"
#include "perikit/model/elastic_constants.hpp"
#include "perikit/sdk/rubber_free_stress.hpp"
#include "perikit/sdk/rubber_invariants.hpp"
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

  template <class T, class S>
  static RubberInvariants<T> invariants(const Tensor<T, S>& H) noexcept {
    return RubberInvariants<T>(H);
  }

  template <class T, class S, class K>
  T psi(const Tensor<T, S>& H, const K& k, const RubberInvariants<T>& of) const noexcept {
    const auto& [mu, kappa] = k;
    return 0.5 * mu * first_isochoric_strain(H, of) + volumetric_energy(volumetric, kappa, of.j);
  }

  template <class T, class S, class K>
  Tensor<T, S> P(const Tensor<T, S>& H, const K& k, const RubberInvariants<T>& of) const noexcept {
    const auto& [mu, kappa] = k;
    const T square = of.root * of.root, shear = mu * square;
    const T pressure = volumetric_kirchhoff(volumetric, kappa, of.j) - shear * of.m;
    return two_term_stress(shear, pressure, H, cofactor_minus_identity(H), of.j, T(of.root * square));
  }

  /// With P = a F + c F^-T, a = mu J^(-2/3), c = J psi_vol' - a (1 + m):
  ///   dP = a dF - c F^-T dF^T F^-T + da F + dc F^-T,  da/a = -2/3 dJ/J,  dJ/J = F^-T : dF,  dm = 2/3 F : dF
  template <class T, class S, class K>
  auto tangent(const Tensor<T, S>& H, const K& k, const RubberInvariants<T>& of) const noexcept {
    const auto& [mu, kappa] = k;
    const T &j = of.j, &m = of.m, &root = of.root;
    const T a = mu * (root * root);
    const T c = volumetric_kirchhoff(volumetric, kappa, j) - a * (1.0 + m);
    const T c_by_volume = volumetric_kirchhoff_slope(volumetric, kappa, j) + (2.0 / 3) * a * (1.0 + m);  // dc for dJ/J = 1
    // Captured where they are made: copies of tensors would take a tenth of the time.
    return [a, c, c_by_volume, F = add_diagonal(H, T(1.0)),
            G = (root * (root * root)) * add_diagonal(cofactor_minus_identity(H), T(1.0))](const Tensor<T, S>& dH) {  // G: F^-T
      const T volume = inner(G, dH), shape = T(2.0 / 3) * a * inner(F, dH);
      const Tensor<T, S> turned = G * (transpose_times(dH, G));
      return a * dH + (T(-2.0 / 3) * a * volume) * F + (c_by_volume * volume - shape) * G - c * turned;
    };
  }

  template <class K>
  std::array<K, 2> isochoric(const std::array<K, 2>& k) const noexcept {
    return {k[0], K(0.0)};
  }
  template <class T, class K>
  VolumeResponse<T> volume(const T& j, const K& k) const noexcept {
    return volume_response(volumetric, k[1], j);
  }

  template <class T, class S, class K>
  auto free_stress(const Tensor<T, S>& H, const K& k) const noexcept {
    const auto& [mu, kappa] = k;
    return RubberFreeStress<T, S, false>(H, T(0.5 * mu), T(0.0), T(kappa), volumetric);
  }
};

}  // namespace perikit
