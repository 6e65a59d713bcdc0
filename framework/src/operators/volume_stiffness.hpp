#pragma once
#include <algorithm>

namespace perikit {

/// Second derivative of an energy density by ln J where F grows alike in all directions, that by t of psi(exp(t/3) F) at t = 0:
/// (F : A : F + P : F)/9, or 0 where that is negative [Pa]. Components lie `stride` apart.
inline double volume_stiffness(int components, int stride, const double* F, const double* P, const double* AF) noexcept {
  double sum = 0;
  for (int at = 0; at < components * stride; at += stride) sum += F[at] * (AF[at] + P[at]);
  return std::max(0.0, sum / 9);
}

}  // namespace perikit
