#pragma once
/// Plane and uniaxial stress of rubber laws with energies linear in the invariants of the isochoric deformation.

#include "perikit/core/tensor.hpp"
#include "perikit/sdk/free_stretch.hpp"
#include "perikit/sdk/volumetric.hpp"

namespace perikit {

/// Free Kirchhoff stress of psi = C1 (J^(-2/3) I1 - 3) + C2 (J^(-4/3) I2 - 3) + psi_vol(kappa, J) over the free strain h. With b the free
/// principal value of F F^T, e = b - 1, and of the given ones c = tr - 2, g = det - 1 (plane), or b1 = 1 + c (bar), s = J^(-2/3):
///   plane:  2 C1 s (2 e - c)/3 + 2 C2 s^2 (c + 2 e + c e - 2 g)/3 + J psi_vol'(J)
///   bar:    2 C1 s (e - c)/3   + 2 C2 s^2 b (e - c)/3             + J psi_vol'(J)
/// every term of the order of the strains.
template <class T, class S>
auto rubber_free_stress(const Tensor<T, S>& H, const T& C1, const T& C2, const T& kappa, Volumetric volumetric) noexcept {
  const Tensor<T, S> given = with_free_part(H, T(0.0)), strain = right_cauchy_green_minus_identity(given);
  const T j = jacobian_minus_one(given), g = j * (2.0 + j);
  T c = 0.0;
  for (int i = 0; i < S::dimension; ++i) c += strain(i, i);
  return [=](const T& h) {
    constexpr bool plane = S::dimension == 2;
    const T e = h * (2.0 + h), b = 1.0 + e, volume = plane ? T(j + h * (1.0 + j)) : T(j + e * (1.0 + j));
    const T root = reciprocal_cbrt(T(1.0 + volume)), s = root * root;
    const T first = (2.0 / 3) * C1 * s, second = (2.0 / 3) * C2 * (s * s), slope = volumetric_kirchhoff_slope(volumetric, kappa, volume);
    const T pressure = volumetric_kirchhoff(volumetric, kappa, volume);
    if constexpr (plane) {
      const T on_first = 2.0 * e - c, on_second = c + 2.0 * e + c * e - 2.0 * g;
      return FreeStress<T>{first * on_first + second * on_second + pressure,
                           first * (4.0 * b - (2.0 / 3) * on_first) + second * ((4.0 + 2.0 * c) * b - (4.0 / 3) * on_second) + slope};
    } else {
      const T difference = e - c;
      return FreeStress<T>{(first + second * b) * difference + pressure,
                           first * (2.0 * b - (4.0 / 3) * difference) + second * b * (2.0 * b + (2.0 - 8.0 / 3) * difference) + 2.0 * slope};
    }
  };
}

}  // namespace perikit
