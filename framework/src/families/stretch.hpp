#pragma once
#include "perikit/core/simd.hpp"

namespace perikit {

/// Extension and direction of a deformed bond. e = (|y|^2 - |xi|^2)/(|y| + |xi|) keeps its digits for small strains and is
/// exactly zero for du = 0.
template <int D>
struct Stretch {
  Pack e, inverse_length, n[D];

  Stretch(const Pack (&xi)[D], Pack length, const Pack (&du)[D]) noexcept {
    Pack difference(0.0), y[D];
    for (int c = 0; c < D; ++c) {
      y[c] = xi[c] + du[c];
      difference += du[c] * (xi[c] + y[c]);
    }
    const ReciprocalRootAndSum reciprocal(length * length + difference, length);
    inverse_length = reciprocal.root;
    e = difference * reciprocal.sum;
    for (int c = 0; c < D; ++c) n[c] = y[c] * inverse_length;
  }
  /// Whether the bond has a finite length and not less than 1e-7 of that at rest: |y|^2 has no digits left below, nor has the direction.
  PackMask has_length(Pack length) const noexcept { return e > Pack(1e-7 - 1.0) * length; }
  Pack along(const Pack (&dw)[D]) const noexcept {
    Pack sum(0.0);
    for (int c = 0; c < D; ++c) sum += n[c] * dw[c];
    return sum;
  }
};

}  // namespace perikit
