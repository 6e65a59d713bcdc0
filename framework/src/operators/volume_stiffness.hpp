#pragma once
#include <algorithm>

#include "perikit/operators/laws.hpp"

namespace perikit {

/// Second derivative of an energy density by ln J where F grows alike in all directions, that by t of psi(exp(t/3) F) at t = 0:
/// (F : A : F + P : F)/9, or 0 where that is negative [Pa]. Of one lane of arrays [component][lane] with stride batch_points.
inline double volume_stiffness(int components, int lane, const double* F, const double* P, const double* AF) noexcept {
  double sum = 0;
  for (int at = lane; at < components * batch_points; at += batch_points) sum += F[at] * (AF[at] + P[at]);
  return std::max(0.0, sum / 9);
}

}  // namespace perikit
