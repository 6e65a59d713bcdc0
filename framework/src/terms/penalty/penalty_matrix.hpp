#pragma once
#include "families/shape_tensor.hpp"
#include "perikit/model/stabilization.hpp"

namespace perikit {

/// Whether a point with a shape tensor of this condition is penalised. The force counts on K^-1 K = I, which rounding breaks by
/// eps times the condition, and M can be as large as K^-1: beyond 1 / poor_ratio the sum of squares would show as negative
/// eigenvalues. Such a family has hardly more bonds that matter than the gradient sees.
inline bool penalised(double condition) noexcept {
  return condition * poor_ratio < 1;
}

/// Symmetric matrices M_i: one number where M_i = m_i I, else the components of a shape tensor.
template <int D, bool isotropic>
struct PenaltyMatrix {
  static constexpr int components = isotropic ? 1 : symmetric_components(D);

  /// y = M x, for numbers or packs.
  template <class T>
  static void apply(const T* M, const T* x, T* y) noexcept {
    for (int a = 0; a < D; ++a) {
      if constexpr (isotropic) {
        y[a] = M[0] * x[a];
      } else {
        y[a] = M[symmetric_index(D, a, 0)] * x[0];
        for (int b = 1; b < D; ++b) y[a] += M[symmetric_index(D, a, b)] * x[b];
      }
    }
  }
};

}  // namespace perikit
