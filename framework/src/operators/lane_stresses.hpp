#pragma once
/// Cauchy stresses of evaluation points, after an evaluation with Work::sample.

#include "operators/batch.hpp"
#include "perikit/core/simd.hpp"

namespace perikit {

/// Of the first n lanes of a batch, in three dimensions whatever the space is.
struct LaneStresses {
  alignas(64) double sigma[9][batch_points];      ///< row by row [Pa]
  alignas(64) double von_mises[batch_points];   ///< [Pa]

  /// sigma = P F^T / det F; not stored without `tensors`.
  LaneStresses(int n, Space space, const BatchScratch& s, bool tensors = true) noexcept {
    const int d = dimension(space), components = tensor_components(space);
    const bool stress_space = space == Space::plane_stress || space == Space::line_stress;
    for (int l = 0; l < n; l += pack_width) {
      Pack F[3][3], P[3][3];
      for (int a = 0; a < 3; ++a) F[a][a] = 1;
      for (int a = 0; a < d; ++a)
        for (int b = 0; b < d; ++b) {
          F[a][b] += Pack::load(s.H + (a * d + b) * batch_points + l);
          P[a][b] = Pack::load(s.P + (a * d + b) * batch_points + l);
        }
      for (int c = d * d; c < components; ++c) {
        const int axis = d + c - d * d;
        F[axis][axis] += Pack::load(stress_space ? s.lateral + l : s.H + c * batch_points + l);
        P[axis][axis] = Pack::load(s.P + c * batch_points + l);
      }
      const Pack over_J = 1.0 / (F[0][0] * (F[1][1] * F[2][2] - F[1][2] * F[2][1]) - F[0][1] * (F[1][0] * F[2][2] - F[1][2] * F[2][0]) +
                                 F[0][2] * (F[1][0] * F[2][1] - F[1][1] * F[2][0]));
      Pack t[3][3];
      for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b) {
          t[a][b] = (P[a][0] * F[b][0] + P[a][1] * F[b][1] + P[a][2] * F[b][2]) * over_J;
          if (tensors) t[a][b].store(sigma[3 * a + b] + l);
        }
      const Pack xy = t[0][1] * t[0][1] + t[1][2] * t[1][2] + t[0][2] * t[0][2];
      const Pack dx = t[0][0] - t[1][1], dy = t[1][1] - t[2][2], dz = t[2][2] - t[0][0];
      sqrt(0.5 * (dx * dx + dy * dy + dz * dz) + 3.0 * xy).store(von_mises + l);
    }
  }
};

}  // namespace perikit
