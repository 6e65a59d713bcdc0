#pragma once

#include <cmath>

#include "perikit/sdk/plastic.hpp"

namespace perikit {

/// Isotropic hardening of metals, linear and saturating [Voce 1948; Simo 1992]:
///   yield stress(a) = Y + H a + (S - Y) (1 - exp(-r a))
/// With H < 0 the strength ends at the strain a_end where this is zero.
struct J2 {
  static constexpr int flow_constants = 5;   // Y, H, S - Y, r, a_end

  void constants(const MaterialInput& input, const Moduli& elastic, double* k) const {
    const double Y = input.value("yield_stress"), H = input.value("hardening"), r = input.value("saturation_rate");
    const double S = input.has("saturation_stress") ? input.value("saturation_stress") : Y;
    require_positive("yield_stress", Y);
    if (!(S >= Y) || !std::isfinite(S)) refuse_parameter("saturation_stress", S, "a finite value that is not below yield_stress");
    if (!(r >= 0) || !std::isfinite(r)) refuse_parameter("saturation_rate", r, "a finite value that is not below 0");
    if (S > Y && r == 0) refuse_parameter("saturation_rate", r, "a value > 0 where saturation_stress is above yield_stress, which would never come nearer to it");
    if (!(H > -3 * elastic.mu) || !std::isfinite(H)) refuse_parameter("hardening", H, "a finite value above -3 times the shear modulus: a material that softens faster snaps back");
    k[0] = Y, k[1] = H, k[2] = S - Y, k[3] = r, k[4] = end_of_strength(Y, H, S - Y, r);
  }

  template <class T, class K>
  T yield_stress(const T& a, const K& k) const noexcept {
    const auto& [Y, H, saturation, r, end] = k;
    return select(a < end, Y + H * a + saturation * (1.0 - exp(-r * a)), T(0.0));
  }

  template <class T, class K>
  T plastic_work(const T& a, const T& increment, const K& k) const noexcept {
    const auto& [Y, H, saturation, r, end] = k;
    const T step = max(T(0.0), min(increment, T(end - a))), left = exp(-r * a) * expm1(-r * step) / select(r > T(0.0), r, T(1.0));   // (exp(-r (a + step)) - exp(-r a))/r
    return step * (Y + H * (a + 0.5 * step)) + saturation * (step + left);
  }

 private:
  /// The strain beyond which the yield stress is not positive; a number beyond all strains where it always is.
  static double end_of_strength(double Y, double H, double saturation, double r) {
    if (H >= 0) return 1e300;
    double lower = 0, upper = -(Y + saturation) / H;   // the yield stress is concave, positive at 0 and not at `upper`
    for (int i = 0; i < 200 && lower < upper; ++i) {
      const double middle = 0.5 * (lower + upper);
      if (middle == lower || middle == upper) break;
      (Y + H * middle - saturation * std::expm1(-r * middle) > 0 ? lower : upper) = middle;
    }
    return upper;
  }
};

}  // namespace perikit
