#pragma once
/// Volumetric parts of rubber-like laws, in j = J - 1 so that small changes of volume keep their digits.

#include "perikit/core/dual.hpp"

namespace perikit {

enum class Volumetric {
  quadratic,    ///< kappa/2 (J - 1)^2
  logarithmic,  ///< kappa/2 (ln J)^2
};

template <class T, class K>
T volumetric_energy(Volumetric form, const K& kappa, const T& j) noexcept {
  const T strain = form == Volumetric::quadratic ? j : log1p(j);
  return 0.5 * kappa * (strain * strain);
}

/// J dpsi/dJ, the mean Kirchhoff stress.
template <class T, class K>
T volumetric_kirchhoff(Volumetric form, const K& kappa, const T& j) noexcept {
  return form == Volumetric::quadratic ? T(kappa * (j + j * j)) : T(kappa * log1p(j));
}

/// J times the derivative of volumetric_kirchhoff by J.
template <class T, class K>
T volumetric_kirchhoff_slope(Volumetric form, const K& kappa, const T& j) noexcept {
  return form == Volumetric::quadratic ? T(kappa * ((1.0 + j) * (1.0 + 2.0 * j))) : T(kappa);
}

/// U(J), tau = J U' and J dtau/dJ.
template <class T>
struct VolumeResponse {
  T energy, kirchhoff, slope;
};

template <class T, class K>
VolumeResponse<T> volume_response(Volumetric form, const K& kappa, const T& j) noexcept {
  return {volumetric_energy(form, kappa, j), volumetric_kirchhoff(form, kappa, j), volumetric_kirchhoff_slope(form, kappa, j)};
}

}  // namespace perikit
