#pragma once
#include "perikit/core/simd.hpp"

namespace perikit {

/// Extension of a deformed bond y; its direction is y times its inverse length. e = (|y|^2 - |xi|^2)/(|y| + |xi|) keeps its digits for small strains
/// and is exactly zero for du = 0. A division, beside a root that needs none: the one waits for its unit while the other computes.
template <int D>
struct Stretch {
  Pack e, inverse_length, y[D];

  Stretch(const Pack (&xi)[D], Pack length, const Pack (&du)[D]) noexcept {
    for (int c = 0; c < D; ++c) y[c] = xi[c] + du[c];
    Pack difference = du[0] * (xi[0] + y[0]);
    for (int c = 1; c < D; ++c) difference += du[c] * (xi[c] + y[c]);
    const Pack square = length * length + difference;
    inverse_length = reciprocal_root(square);
    e = difference / (square * inverse_length + length);
  }
  /// The extension of a bond of 1e-7 of its length, over its length.
  static constexpr double shortest = 1e-7 - 1.0;
  /// Whether the bond has a finite length and not less than 1e-7 of that at rest: |y|^2 has no digits left below, nor has the direction.
  PackMask has_length(Pack length) const noexcept { return e > Pack(shortest) * length; }
  Pack along(const Pack (&dw)[D]) const noexcept {
    Pack sum = y[0] * dw[0];
    for (int c = 1; c < D; ++c) sum += y[c] * dw[c];
    return inverse_length * sum;
  }
};

}  // namespace perikit
