#pragma once

#include <array>

#include "perikit/core/tensor.hpp"
#include "perikit/model/elastic_constants.hpp"
#include "perikit/sdk/rubber_free_stress.hpp"
#include "perikit/sdk/rubber_invariants.hpp"
#include "perikit/sdk/volumetric.hpp"

namespace perikit {

/// Compressible Mooney-Rivlin rubber [Scabbia et al. 2025, eqs. 3-7].
///   psi = C1 (J^(-2/3) I1 - 3) + C2 (J^(-4/3) I2 - 3) + psi_vol(kappa, J),  I1, I2 invariants of C
///   P = tau F^-T,  tau = dev(2 C1 J^(-2/3) b + 2 C2 J^(-4/3) (I1 b - b^2)) + J psi_vol'(J) I,  b = F F^T.
/// Written in e = b - I, every term of the order of e: I1 b - b^2 = I2 I - cof b (Cayley-Hamilton), cof b = I + tr(e) I - e + cof
/// e.
struct MooneyRivlin {
  static constexpr MaterialTraits traits{.constants = 3};
  Volumetric volumetric = Volumetric::quadratic;

  void constants(const MaterialInput& input, double* k) const {
    k[0] = input.value("C1");
    k[1] = input.value("C2");
    k[2] = input.value("bulk_modulus");
    require_positive("C1 + C2", k[0] + k[1], "half the shear modulus");
    require_positive("bulk_modulus", k[2]);
  }
  Moduli small_strain(const double* k) const noexcept {
    const double mu = 2 * (k[0] + k[1]);
    return {k[2] - 2 * mu / 3, mu};
  }

  template <class T, class S>
  static RubberInvariants<T> invariants(const Tensor<T, S>& H) noexcept {
    return RubberInvariants<T>(H);
  }

  template <class T, class S, class K>
  T psi(const Tensor<T, S>& H, const K& k, const RubberInvariants<T>& of) const noexcept {
    const auto& [C1, C2, kappa] = k;
    const T first = first_isochoric_strain(H, of), second = second_isochoric_strain(deviator(left_cauchy_green_minus_identity(H)), of, first);
    return C1 * first + C2 * second + volumetric_energy(volumetric, kappa, of.j);
  }

  template <class T, class S, class K>
  Tensor<T, S> P(const Tensor<T, S>& H, const K& k, const RubberInvariants<T>& of) const noexcept {
    const auto& [C1, C2, kappa] = k;
    const T &j = of.j, &m = of.m, &root = of.root;
    const Tensor<T, S> e = left_cauchy_green_minus_identity(H);
    const T scale = root * root, inverse_J = scale * root;  // J^(-2/3), 1/J
    const T second = 2.0 * C2 * (scale * scale), both = 2.0 * C1 * scale + second;
    const T I2 = second_invariant_of_strain(e, j);
    const T pressure = volumetric_kirchhoff(volumetric, kappa, j) - (both * m - second * (I2 * (1.0 / 3.0)));
    return three_term_stress(both, second, pressure, e, I2, H, j, inverse_J);
  }

  /// dP = (dtau - P dF^T) F^-T, dtau from db = 2 sym(dF F^T) and dJ/J = F^-T : dF.
  template <class T, class S, class K>
  auto tangent(const Tensor<T, S>& H, const K& k, const RubberInvariants<T>& of) const noexcept {
    const auto& [C1, C2, kappa] = k;
    const Tensor<T, S> e = left_cauchy_green_minus_identity(H), d = deviator(e);
    const T &j = of.j, &m = of.m, &root = of.root;
    const T scale = root * root;
    const T first = 2.0 * C1 * scale, second = 2.0 * C2 * (scale * scale), on_d = first + second * (1.0 + m);
    const Tensor<T, S> square = second * deviator(gram(d));
    const Tensor<T, S> tau = add_diagonal(on_d * d - square, volumetric_kirchhoff(volumetric, kappa, j));
    const Tensor<T, S> G = (scale * root) * add_diagonal(cofactor_minus_identity(H), T(1.0)), P = tau * G;  // F^-T
    return [=, by_volume = add_diagonal(                                                                    // dtau for dJ/J = 1
                   T(-2.0 / 3) * (first * d) - T(4.0 / 3) * ((second * (1.0 + m)) * d - square),
                   volumetric_kirchhoff_slope(volumetric, kappa, j))](const Tensor<T, S>& dH) {
      const Tensor<T, S> de = T(2.0) * symmetric_part(dH + dH * transpose(H)), dd = deviator(de);
      const Tensor<T, S> turn = (second * (1.0 / 3.0)) * (trace(de) * d) - (2.0 * second) * deviator(symmetric_part(d * dd));
      const Tensor<T, S> dtau = on_d * dd + turn + inner(G, dH) * by_volume;
      return (dtau - P * transpose(dH)) * G;
    };
  }

  template <class K>
  std::array<K, 3> isochoric(const std::array<K, 3>& k) const noexcept {
    return {k[0], k[1], K(0.0)};
  }
  template <class T, class K>
  VolumeResponse<T> volume(const T& j, const K& k) const noexcept {
    return volume_response(volumetric, k[2], j);
  }

  template <class T, class S, class K>
  auto free_stress(const Tensor<T, S>& H, const K& k) const noexcept {
    const auto& [C1, C2, kappa] = k;
    return RubberFreeStress<T, S, true>(H, T(C1), T(C2), T(kappa), volumetric);
  }
};

}  // namespace perikit
