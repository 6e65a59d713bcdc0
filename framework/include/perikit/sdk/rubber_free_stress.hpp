#pragma once
/// Plane and uniaxial stress of rubber laws with energies linear in the invariants of the isochoric deformation.

#include <array>
#include <limits>

#include "perikit/core/tensor.hpp"
#include "perikit/sdk/free_stretch.hpp"
#include "perikit/sdk/volumetric.hpp"

namespace perikit {

/// Free Kirchhoff stress of psi = C1 (J^(-2/3) I1 - 3) + C2 (J^(-4/3) I2 - 3) + psi_vol(kappa, J). With b the free principal value of
/// F F^T, e = b - 1, and of the given ones c = tr - 2, g = det - 1 (plane), or b1 = 1 + c (bar), s = J^(-2/3), it is
///   plane:  2 C1 s (2 e - c)/3 + 2 C2 s^2 (c + 2 e + c e - 2 g)/3 + J psi_vol'(J)
///   bar:    2 C1 s (e - c)/3   + 2 C2 s^2 b (e - c)/3             + J psi_vol'(J)
/// every term of the order of the strains. has_second: C2 may be other than zero.
template <class T, class S, bool has_second>
class RubberFreeStress {
 public:
  RubberFreeStress() = default;
  /// The free components of H are not read.
  RubberFreeStress(const Tensor<T, S>& H, const T& C1, const T& C2, const T& kappa, Volumetric volumetric) noexcept
      : C1_((2.0 / 3) * C1), C2_((2.0 / 3) * C2), kappa_(kappa), volumetric_(volumetric) {
    const Tensor<T, S> given = with_free_part(H, T(0.0)), strain = right_cauchy_green_minus_identity(given);
    j_ = jacobian_minus_one(given);
    c_ = strain(0, 0);
    for (int i = 1; i < S::dimension; ++i) c_ += strain(i, i);
    inverse_ = reciprocal(T(1.0 + j_));
  }

  /// At the free strain h.
  FreeStress<T> operator()(const T& h) const noexcept {
    const T e = h * (2.0 + h), b = 1.0 + e, volume = plane ? T(j_ + h * (1.0 + j_)) : T(j_ + e * (1.0 + j_));
    const T root = reciprocal_cbrt(T(1.0 + volume)), s = root * root;
    const T first = C1_ * s, second = by_C2(s * s), slope = volumetric_kirchhoff_slope(volumetric_, kappa_, volume);
    const T pressure = volumetric_kirchhoff(volumetric_, kappa_, volume);
    if constexpr (plane) {
      const T on_first = 2.0 * e - c_, on_second = c_ + 2.0 * e + c_ * e - 2.0 * (j_ * (2.0 + j_));
      return {first * on_first + second * on_second + pressure,
              first * (4.0 * b - (2.0 / 3) * on_first) + second * ((4.0 + 2.0 * c_) * b - (4.0 / 3) * on_second) + slope};
    } else {
      const T difference = e - c_;
      return {(first + second * b) * difference + pressure,
              first * (2.0 * b - (4.0 / 3) * difference) + second * b * (2.0 * b + (2.0 - 8.0 / 3) * difference) + 2.0 * slope};
    }
  }

  /// The polynomial of zeros() about rest, to second order: slope d - linear j + curvature d^2 + mixed d j - square j^2 - shear (c - 2 j).
  /// Its zero is d = by_j j + by_square j^2 + by_shear (c - 2 j). Divided by q^2 it has 2 (slope) less of curvature.
  struct Rest {
    T by_j, by_square, by_shear, curvature;
  };
  Rest rest() const noexcept {
    const double bulk = volumetric_ == Volumetric::quadratic ? 24 : 10.5;
    const T linear = (plane ? 6.0 : 3.0) * (C1_ + C2_), slope = (plane ? 2.0 : 1.0) * linear + 3.0 * kappa_, inverse = reciprocal(slope);
    const T curvature = plane ? T(54.0 * C1_ + 30.0 * C2_ + bulk * kappa_) : T(9.0 * C1_ + 12.0 * C2_ + bulk * kappa_);
    const T mixed = plane ? T(12.0 * (C2_ - C1_) + 6.0 * kappa_) : T(3.0 * kappa_ - 6.0 * C1_ - 12.0 * C2_);
    const T square = plane ? T(6.0 * C1_ + 12.0 * C2_) : T(3.0 * C1_), by_j = linear * inverse;
    return {by_j, (square - by_j * (mixed + curvature * by_j)) * inverse, plane ? T((C1_ - C2_) * inverse) : T(0.0),
            plane && !has_second ? T(curvature - 2.0 * slope) : curvature};
  }

  /// Where it vanishes, for several of these at once, so that they need not wait for each other: the free strains h, not a number where
  /// a few steps do not end at a zero that stress grows through, and the roots q = 1 + d of J = q^3 that go with them. The stress times
  /// q^4 (1 + j)^2 in a plane (q^2 (1 + j)^2 without C2), q^4 (1 + j) in a bar, is a polynomial of q and of the volumetric stress: no step needs
  /// a root or a power.
  template <std::size_t count>
  static void zeros(const std::array<RubberFreeStress, count>& of, const std::array<Rest, count>& rest, T* h, T* q) noexcept {
    if (of[0].volumetric_ == Volumetric::quadratic)
      zeros_of<Volumetric::quadratic>(of, rest, h, q);
    else
      zeros_of<Volumetric::logarithmic>(of, rest, h, q);
  }

  /// P at that zero: the given Kirchhoff stress less the free one, which leaves no pressure. With I1 b - b^2 = I2 I - cof b,
  ///   plane:  2 C1 s (b - b33 I) + 2 C2 s^2 ((1 + g) I - b33 cof b),   tau F^-T = a (F - F^-T) + p F^-T
  ///   bar:    (c - e) (2 C1 s + 2 C2 s^2 b)
  Tensor<T, S> stress(const Tensor<T, S>& H, const T& q) const noexcept {
    const T h = H(2, 2), e = h * (2.0 + h), s = reciprocal(T(q * q)), first = 3.0 * C1_ * s, second = 3.0 * by_C2(s * s);
    const T on_F = has_second ? T(first + second * (1.0 + e)) : first;
    Tensor<T, S> P = with_free_part(H, T(0.0));
    if constexpr (plane) {
      const T p = has_second ? T(second * (j_ * (2.0 + j_) - c_ - e * (1.0 + c_)) - first * e) : T(-first * e);
      const T on_cofactor = (p - on_F) * inverse_, on_identity = (on_F * j_ + p) * inverse_;
      P(0, 0) = on_F * H(0, 0) + on_cofactor * H(1, 1) + on_identity;
      P(1, 1) = on_F * H(1, 1) + on_cofactor * H(0, 0) + on_identity;
      P(0, 1) = on_F * H(0, 1) - on_cofactor * H(1, 0);
      P(1, 0) = on_F * H(1, 0) - on_cofactor * H(0, 1);
    } else {
      P(0, 0) = on_F * (c_ - e) * inverse_;
    }
    return P;
  }

  /// dH -> dP there. With x the determinant of the block F of the space, X = ln x, t = tr F F^T, y = b33 = exp(2 z) in a plane and exp(z) in a bar,
  /// psi(t, X, z) is least where the free stress vanishes; what is left there of its second derivatives is
  ///   W_tt = -psi_tz^2/psi_zz,  W_tX = psi_tX - psi_tz psi_Xz/psi_zz,  W_XX = psi_XX - psi_Xz^2/psi_zz,
  /// multiplied out, so that no term is a difference (psi_zz = c + B with the slope B of the volumetric stress; in a bar the isochoric part depends on
  /// X - z/2 alone). With these
  ///   P = 2 psi_t F + psi_X F^-T,  dt = 2 F : dF,  dX = F^-T : dF,  d(cof F) = cof(dF)
  auto tangent(const Tensor<T, S>& H, const T& q) const noexcept {
    const T q2 = q * q, J = q * q2, stretch = J * inverse_, y = plane ? T(stretch * stretch) : stretch, x = 1.0 + j_;
    const T s = reciprocal(q2), first = C1_ * s, second = by_C2(s * s), bulk = volumetric_kirchhoff_slope(volumetric_, kappa_, T(J - 1.0));
    if constexpr (plane) {
      const T t = 2.0 + c_, x2 = x * x, ty = t * y;
      const T c = (2.0 / 3) * (first * (t + 4.0 * y) + second * (4.0 * x2 + ty)), inverse_slope = reciprocal(T(bulk + c));
      const T mixed = first * second, by_z = second * y - first, by_x = 3.0 * (second * (x2 - ty) - first * y);
      const T WtX = (3.0 * (second * bulk) + 4.0 * (first * first + second * second * x2)) * y + 4.0 * (mixed * (x2 + ty + y * y));
      const T WXX = 6.0 * (bulk * (first * y + second * (x2 + ty))) + 4.0 * (ty * (first * first + second * second * x2) + mixed * (x2 * t + ty * (t + y)));
      const T on_F = 3.0 * (first + second * y), on_cofactor = by_x * inverse_;
      const T FF = -4.0 * (by_z * by_z * inverse_slope), FG = -2.0 * (WtX * inverse_slope) * inverse_, GG = (WXX * inverse_slope - by_x) * (inverse_ * inverse_);
      const T F00 = 1.0 + H(0, 0), F11 = 1.0 + H(1, 1), F01 = H(0, 1), F10 = H(1, 0);
      return [=](const Tensor<T, S>& dH) {
        const T &d00 = dH(0, 0), &d01 = dH(0, 1), &d10 = dH(1, 0), &d11 = dH(1, 1);
        const T shape = F00 * d00 + F01 * d01 + F10 * d10 + F11 * d11, area = F11 * d00 - F10 * d01 - F01 * d10 + F00 * d11;
        const T f = FF * shape + FG * area, g = FG * shape + GG * area;
        Tensor<T, S> dP = dH;
        dP(0, 0) = on_F * d00 + on_cofactor * d11 + (f * F00 + g * F11);
        dP(1, 1) = on_F * d11 + on_cofactor * d00 + (f * F11 + g * F00);
        dP(0, 1) = on_F * d01 - on_cofactor * d10 + (f * F01 - g * F10);
        dP(1, 0) = on_F * d10 - on_cofactor * d01 + (f * F10 - g * F01);
        return dP;
      };
    } else {
      const T x2 = x * x, c = (1.0 / 3) * (first * (2.0 * x2 + y) + second * (y * (2.0 * y + x2)));
      const T slope = (9.0 * (bulk * c) * reciprocal(T(bulk + c)) - 3.0 * (x2 - y) * (first + second * y)) * (inverse_ * inverse_);
      return [=](const Tensor<T, S>& dH) {
        Tensor<T, S> dP = dH;
        dP(0, 0) = slope * dH(0, 0);
        return dP;
      };
    }
  }

 private:
  static constexpr bool plane = S::dimension == 2;
  static constexpr int most_steps = 6;
  /// With the curvature at rest, a step leaves its square times the strains, within a factor of ten or so.
  static constexpr double last_step = 3e-9;

  template <Volumetric volumetric, std::size_t count>
  static void zeros_of(const std::array<RubberFreeStress, count>& of, const std::array<Rest, count>& rest, T* h, T* q) noexcept {
    using Mask = decltype(T(0.0) == T(0.0));
    T d[count], per_slope[count];
    Mask active[count], grows[count];
    PERIKIT_UNROLL for (std::size_t i = 0; i < count; ++i) {
      const T &j = of[i].j_, shear = of[i].c_ - 2.0 * j;
      d[i] = rest[i].by_shear * shear + j * (rest[i].by_j + rest[i].by_square * j);
      active[i] = grows[i] = j > -1.0;
    }
    for (int step = 0; step < most_steps; ++step) {
      Mask any_active = T(0.0) > T(0.0);
      PERIKIT_UNROLL for (std::size_t i = 0; i < count; ++i) {
        const FreeStress<T> at = of[i].template polynomial<volumetric>(d[i]);
        per_slope[i] = step == 0 ? reciprocal(at.slope) : T(per_slope[i] * (2.0 - at.slope * per_slope[i]));
        const T newton = at.value * per_slope[i], square = newton * newton;
        // Each lane ends by itself, whatever its neighbours do.
        d[i] = select(active[i], d[i] - (newton + (rest[i].curvature * per_slope[i]) * square), d[i]);
        grows[i] &= (at.slope > 0.0) | !active[i];
        active[i] &= square > last_step * last_step;
        any_active |= active[i];
      }
      if (!any(any_active)) break;
    }
    PERIKIT_UNROLL for (std::size_t i = 0; i < count; ++i) {
      q[i] = 1.0 + d[i];
      const T strain = (d[i] * (3.0 + d[i] * (3.0 + d[i])) - of[i].j_) * of[i].inverse_;  // in a bar of the stretch's square
      const T found = plane ? strain : T(strain / (1.0 + sqrt(T(1.0 + strain))));
      h[i] = select(grows[i] & !active[i] & (d[i] > -1.0), found, T(std::numeric_limits<double>::quiet_NaN()));
    }
  }

  /// The stress times q^4 (1 + j)^2, q^2 (1 + j)^2 or q^4 (1 + j), over d = q - 1.
  template <Volumetric volumetric>
  FreeStress<T> polynomial(const T& d) const noexcept {
    const T J0 = 1.0 + j_, M = plane ? T(J0 * J0) : J0, K = M * kappa_, c = c_ * M, q = 1.0 + d, q2 = q * q, v = d * (3.0 + d * (3.0 + d)), J = 1.0 + v;
    const T pressure = volumetric_kirchhoff(volumetric, K, v), bulk = volumetric_kirchhoff_slope(volumetric, K, v);
    if constexpr (plane) {
      const T E = (v - j_) * (J0 + J), on_first = 2.0 * E - c, by_E = (6.0 * J) * q2;  // E: e (1 + j)^2, by_E: dE/dq
      if constexpr (!has_second) return {C1_ * on_first + q2 * pressure, (2.0 * C1_) * by_E + q * (2.0 * pressure + 3.0 * bulk)};
      const T C2t = C2_ * (2.0 + c_), first = C1_ * q;
      return {(first * q) * on_first + (C2t * E + (C2_ * M) * (c_ - 2.0 * (j_ * (2.0 + j_)))) + (q * J) * pressure,
              2.0 * (first * on_first) + (2.0 * (first * q) + C2t) * by_E + J * (4.0 * pressure + 3.0 * bulk)};
    } else {
      const T difference = (v - j_) - c, second = by_C2(inverse_), both = has_second ? T(C1_ * q2 + second * J) : T(C1_ * q2), by_q = 3.0 * q2;
      const T slope = has_second ? T(2.0 * C1_ * q + second * by_q) : T(2.0 * C1_ * q);
      return {both * difference + (q * J) * pressure, slope * difference + both * by_q + J * (4.0 * pressure + 3.0 * bulk)};
    }
  }

  /// C2 times x.
  T by_C2([[maybe_unused]] const T& x) const noexcept {
    if constexpr (has_second) return C2_ * x;
    else return T(0.0);
  }

  T C1_, C2_, kappa_;  // C1, C2: times 2/3
  T c_, j_, inverse_;  // inverse: 1/(1 + j)
  Volumetric volumetric_;
};

}  // namespace perikit
