#pragma once
/// What the fourth and the third moments of a family are made of: polynomials of the direction n of a bond that are orthonormal over all directions (the mean
/// of the square of each is 1). The even ones span the components of n (x) n (x) n (x) n, the odd ones those of n (x) n (x) n: on a line 1 and n,
/// on a circle Fourier terms, on a sphere spherical harmonics of degrees 0, 2, 4 and 1, 3.

#include <cmath>

#include "perikit/core/simd.hpp"

namespace perikit {

template <int D>
inline constexpr int even_moments = D == 1 ? 1 : D == 2 ? 5 : 15;
template <int D>
inline constexpr int odd_moments = D == 1 ? 1 : D == 2 ? 4 : 10;

/// The even polynomials of n, the first of which is 1. Scalar: double or Pack.
template <int D, class Scalar>
void even_polynomials(const Scalar (&n)[D], Scalar (&out)[even_moments<D>]) noexcept {
  out[0] = Scalar(1.0);
  if constexpr (D == 2) {
    const Scalar c2 = n[0] * n[0] - n[1] * n[1], s2 = Scalar(2.0) * n[0] * n[1];
    const Scalar root(std::sqrt(2.0));
    out[1] = root * c2;
    out[2] = root * s2;
    out[3] = root * (c2 * c2 - s2 * s2);
    out[4] = root * Scalar(2.0) * c2 * s2;
  }
  if constexpr (D == 3) {
    const Scalar x = n[0], y = n[1], z = n[2], xx = x * x, yy = y * y, zz = z * z, difference = xx - yy;
    const auto times = [](double factor, Scalar value) { return Scalar(factor) * value; };
    out[1] = times(std::sqrt(15.0), x * y);
    out[2] = times(std::sqrt(15.0), y * z);
    out[3] = times(std::sqrt(15.0), z * x);
    out[4] = times(std::sqrt(5.0) / 2, Scalar(3.0) * zz - Scalar(1.0));
    out[5] = times(std::sqrt(15.0) / 2, difference);
    out[6] = times(1.5 * std::sqrt(35.0), x * y * difference);
    out[7] = times(1.5 * std::sqrt(17.5), y * z * (Scalar(3.0) * xx - yy));
    out[8] = times(1.5 * std::sqrt(5.0), x * y * (Scalar(7.0) * zz - Scalar(1.0)));
    out[9] = times(1.5 * std::sqrt(2.5), y * z * (Scalar(7.0) * zz - Scalar(3.0)));
    out[10] = times(0.375, Scalar(35.0) * zz * zz - Scalar(30.0) * zz + Scalar(3.0));
    out[11] = times(1.5 * std::sqrt(2.5), x * z * (Scalar(7.0) * zz - Scalar(3.0)));
    out[12] = times(0.75 * std::sqrt(5.0), difference * (Scalar(7.0) * zz - Scalar(1.0)));
    out[13] = times(1.5 * std::sqrt(17.5), x * z * (xx - Scalar(3.0) * yy));
    out[14] = times(0.375 * std::sqrt(35.0), difference * difference - Scalar(4.0) * xx * yy);
  }
}

/// The odd polynomials of n.
template <int D, class Scalar>
void odd_polynomials(const Scalar (&n)[D], Scalar (&out)[odd_moments<D>]) noexcept {
  if constexpr (D == 1) out[0] = n[0];
  if constexpr (D == 2) {
    const Scalar x = n[0], y = n[1], root(std::sqrt(2.0));
    out[0] = root * x;
    out[1] = root * y;
    out[2] = root * x * (x * x - Scalar(3.0) * y * y);
    out[3] = root * y * (Scalar(3.0) * x * x - y * y);
  }
  if constexpr (D == 3) {
    const Scalar x = n[0], y = n[1], z = n[2], xx = x * x, yy = y * y, zz = z * z;
    const auto times = [](double factor, Scalar value) { return Scalar(factor) * value; };
    out[0] = times(std::sqrt(3.0), x);
    out[1] = times(std::sqrt(3.0), y);
    out[2] = times(std::sqrt(3.0), z);
    out[3] = times(std::sqrt(4.375), y * (Scalar(3.0) * xx - yy));
    out[4] = times(std::sqrt(105.0), x * y * z);
    out[5] = times(std::sqrt(2.625), y * (Scalar(5.0) * zz - Scalar(1.0)));
    out[6] = times(std::sqrt(7.0) / 2, z * (Scalar(5.0) * zz - Scalar(3.0)));
    out[7] = times(std::sqrt(2.625), x * (Scalar(5.0) * zz - Scalar(1.0)));
    out[8] = times(std::sqrt(105.0) / 2, z * (xx - yy));
    out[9] = times(std::sqrt(4.375), x * (xx - Scalar(3.0) * yy));
  }
}

/// Whether an even or odd polynomial changes its sign where axis a of n does.
template <int D>
struct MomentParity {
  bool even[even_moments<D>][D] = {}, odd[odd_moments<D>][D] = {};
  MomentParity() {
    const double direction[3] = {0.48, 0.6, 0.64};
    double n[D], mirrored[D], value[even_moments<D>], image[even_moments<D>], odd_value[odd_moments<D>], odd_image[odd_moments<D>];
    for (int c = 0; c < D; ++c) n[c] = direction[c];
    even_polynomials<D>(n, value);
    odd_polynomials<D>(n, odd_value);
    for (int a = 0; a < D; ++a) {
      for (int c = 0; c < D; ++c) mirrored[c] = c == a ? -n[c] : n[c];
      even_polynomials<D>(mirrored, image);
      odd_polynomials<D>(mirrored, odd_image);
      for (int k = 0; k < even_moments<D>; ++k) even[k][a] = value[k] * image[k] < 0;
      for (int k = 0; k < odd_moments<D>; ++k) odd[k][a] = odd_value[k] * odd_image[k] < 0;
    }
  }
};

}  // namespace perikit
