#pragma once
/// Cauchy stresses of evaluation points, after an evaluation with Work::sample.

#include "operators/batch.hpp"
#include "perikit/core/simd.hpp"
#include "perikit/core/tensor.hpp"

namespace perikit {

/// Of the lanes of a batch, in three dimensions whatever the space is; unset before `find`.
struct LaneStresses {
  alignas(64) double sigma[9][batch_points];      ///< row by row [Pa]
  alignas(64) double von_mises[batch_points];   ///< [Pa]

  /// Of the first n lanes, sigma = P F^T / det F; not stored without `tensors`.
  void find(int n, Space space, const BatchScratch& s, bool tensors = true) noexcept {
    const bool stress_space = space == Space::plane_stress || space == Space::line_stress;
    if (dimension(space) == 3) tensors ? of_lanes<3, true>(n, nullptr, s) : of_lanes<3, false>(n, nullptr, s);
    else if (dimension(space) == 2) of_lanes<2, true>(n, stress_space ? s.lateral : nullptr, s);
    else of_lanes<1, true>(n, stress_space ? s.lateral : nullptr, s);
  }

 private:
  /// lateral: strain of the free axes; null: in s.H.
  template <int d, bool tensors>
  void of_lanes(int n, const double* lateral, const BatchScratch& s) noexcept {
    for (int l = 0; l < n; l += pack_width) {
      Pack F[3][3] = {}, P[3][3] = {};
      PERIKIT_UNROLL for (int a = 0; a < 3; ++a) {
        if (a >= d) {
          const int c = d * d + a - d;
          F[a][a] = 1.0 + Pack::load(lateral ? lateral + l : s.H + c * batch_points + l);
          P[a][a] = Pack::load(s.P + c * batch_points + l);
        }
        PERIKIT_UNROLL for (int b = 0; b < d && a < d; ++b) {
          const Pack H = Pack::load(s.H + (a * d + b) * batch_points + l);
          F[a][b] = a == b ? 1.0 + H : H;
          P[a][b] = Pack::load(s.P + (a * d + b) * batch_points + l);
        }
      }
      const Pack over_J = reciprocal(F[0][0] * (F[1][1] * F[2][2] - F[1][2] * F[2][1]) - F[0][1] * (F[1][0] * F[2][2] - F[1][2] * F[2][0]) +
                                     F[0][2] * (F[1][0] * F[2][1] - F[1][1] * F[2][0]));
      const auto tau = [&](int a, int b) { return P[a][0] * F[b][0] + P[a][1] * F[b][1] + P[a][2] * F[b][2]; };
      if constexpr (tensors)
        for (int c = 0; c < 9; ++c) (tau(c / 3, c % 3) * over_J).store(sigma[c] + l);
      const Pack xx = tau(0, 0), yy = tau(1, 1), zz = tau(2, 2), xy = tau(0, 1), yz = tau(1, 2), xz = tau(0, 2);
      const Pack dx = xx - yy, dy = yy - zz, dz = zz - xx, off = xy * xy + yz * yz + xz * xz;
      (sqrt(0.5 * (dx * dx + dy * dy + dz * dz) + 3.0 * off) * over_J).store(von_mises + l);
    }
  }
};

}  // namespace perikit
