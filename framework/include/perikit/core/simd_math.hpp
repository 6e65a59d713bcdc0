#pragma once
/// Elementary functions of a Pack: log, log1p, exp, expm1, cbrt and rational powers to 2 units in the last place, and tanh to 3, over the whole
/// range of double, with the IEEE results for 0, infinity, NaN, subnormal and inadmissible arguments; and pow, which is less exact. No branches
/// and no loops that depend on the data, so that a lane never sees its neighbours. The same names for scalars: laws are written once.

#include <cmath>
#include <concepts>
#include <cstdint>
#include <initializer_list>
#include <limits>

#include "perikit/core/simd.hpp"

namespace perikit {

template <std::floating_point T>
T sqrt(T x) noexcept {
  return std::sqrt(x);
}
template <std::floating_point T>
T abs(T x) noexcept {
  return std::abs(x);
}
template <Number A, Number B>
std::common_type_t<A, B> min(A a, B b) noexcept {
  return select(a < b, a, b);
}
template <Number A, Number B>
std::common_type_t<A, B> max(A a, B b) noexcept {
  return select(a > b, a, b);
}
template <std::floating_point T>
T log(T x) noexcept {
  return std::log(x);
}
template <std::floating_point T>
T log1p(T x) noexcept {
  return std::log1p(x);
}
template <std::floating_point T>
T exp(T x) noexcept {
  return std::exp(x);
}
template <std::floating_point T>
T expm1(T x) noexcept {
  return std::expm1(x);
}
template <std::floating_point T>
T cbrt(T x) noexcept {
  return std::cbrt(x);
}
template <std::floating_point T>
T tanh(T x) noexcept {
  return std::tanh(x);
}
template <Number A, Number B>
auto pow(A x, B exponent) noexcept {
  return std::pow(x, exponent);
}
template <std::floating_point T>
T reciprocal(T x) noexcept {
  return T(1) / x;
}
template <std::floating_point T>
T reciprocal_cbrt(T x) noexcept {
  return T(1) / std::cbrt(x);
}
namespace detail {

inline Bits bits(Pack a) noexcept {
  return reinterpret_cast<Bits>(a.v);
}
inline Pack from_bits(Bits b) noexcept {
  return {reinterpret_cast<Lanes>(b)};
}

/// a - b modulo 2^64: lanes that hold no positive number, and whose result is not used, may run over.
inline Bits difference(Bits a, Bits b) noexcept {
  typedef std::uint64_t Words __attribute__((vector_size(8 * pack_width)));
  return reinterpret_cast<Bits>(reinterpret_cast<Words>(a) - reinterpret_cast<Words>(b));
}
inline Bits difference(Bits a, std::int64_t b) noexcept { return difference(a, b - Bits{}); }

inline constexpr std::int64_t one_bits = 0x3ff0000000000000;        // 1.0
inline constexpr std::int64_t sqrt_half_bits = 0x3fe6a09e667f3bcd;  // sqrt(1/2)
inline constexpr std::int64_t shifter_bits = 0x4338000000000000;    // 1.5 * 2^52: its last bits count units
inline constexpr double shifter = 6755399441055744.0;
inline constexpr double infinity = std::numeric_limits<double>::infinity();
inline constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();
inline constexpr double ln2_high = 0x1.62e42fee00000p-1;  // k * ln2_high is exact for every exponent k
inline constexpr double ln2_low = 0x1.a39ef35793c76p-33;

/// Small integers as doubles, and the nearest integer of |x| < 2^51 as a double.
inline Pack to_double(Bits k) noexcept {
  return from_bits(k + shifter_bits) - shifter;
}
inline Pack nearest_integer(Pack x) noexcept {
  return (x + shifter) - shifter;
}
/// 2^k for whole -1022 <= k <= 1023.
inline Pack power_of_two(Pack k) noexcept {
  return from_bits((bits(k + shifter) - shifter_bits + 1023) << 52);
}

/// log(x) + correction / x for positive finite x; correction / x is at most a rounding error of x.
inline Pack log_positive(Pack x, Pack correction) noexcept {
  const PackMask subnormal = x < std::numeric_limits<double>::min();
  const Pack scaled = select(subnormal, x * 0x1p54, x);
  const Bits exponent = difference(bits(scaled), sqrt_half_bits) >> 52;
  const Pack k = to_double(exponent) + select(subnormal, Pack(-54.0), Pack(0.0));
  const Pack f = from_bits(difference(bits(scaled), exponent << 52)) - 1.0;  // 1 + f in [sqrt(1/2), sqrt 2)
  // log(1 + f) = 2 artanh(s), s = f / (2 + f), z = s^2 < 0.0295
  const Pack s = f / (2.0 + f), z = s * s;
  Pack series = 2.0 / 23;
  for (const double divisor : {21.0, 19.0, 17.0, 15.0, 13.0, 11.0, 9.0, 7.0, 5.0, 3.0}) series = series * z + 2.0 / divisor;
  const Pack half_square = 0.5 * f * f;
  return k * ln2_high - ((half_square - (s * (half_square + series * z) + (k * ln2_low + correction / x))) - f);
}

/// x = k ln 2 + r, |r| <= ln(2)/2; exp(r) - 1 to a rounding error. k is returned as a double.
inline Pack expm1_reduced(Pack x, Pack& k) noexcept {
  k = nearest_integer(x * 0x1.71547652b82fep+0);
  const Pack high = x - k * ln2_high, low = k * ln2_low;
  const Pack r = high - low, lost = (high - r) - low;
  Pack series = 1.0 / 87178291200.0;
  for (const double divisor :
       {6227020800.0, 479001600.0, 39916800.0, 3628800.0, 362880.0, 40320.0, 5040.0, 720.0, 120.0, 24.0, 6.0, 2.0})
    series = series * r + 1.0 / divisor;
  return r + (r * r * series + lost * (1.0 + r));
}

}  // namespace detail

inline Pack log(Pack x) noexcept {
  const Pack regular = detail::log_positive(x, 0.0);
  const Pack special = select(x == 0.0, Pack(-detail::infinity), Pack(detail::not_a_number));
  return select(x > 0.0, select(x == detail::infinity, x, regular), special);
}

/// log(1 + x) without loss for small x.
inline Pack log1p(Pack x) noexcept {
  const Pack u = 1.0 + x, big = u - 1.0;
  const Pack lost = (1.0 - (u - big)) + (x - big);  // 1 + x = u + lost exactly
  const Pack regular = detail::log_positive(u, lost);
  const Pack special = select(u == 0.0, Pack(-detail::infinity), Pack(detail::not_a_number));
  return select(u > 0.0, select(u == detail::infinity, u, regular), special);
}

inline Pack exp(Pack x) noexcept {
  const Pack inside = select(x > 710.0, Pack(710.0), select(x < -746.0, Pack(-746.0), x));
  Pack k;
  const Pack mantissa = 1.0 + detail::expm1_reduced(inside, k);
  const Pack half = detail::nearest_integer(0.5 * k);  // in two factors: 2^k alone may not be representable
  const Pack finite = mantissa * detail::power_of_two(half) * detail::power_of_two(k - half);
  return select(x == x, finite, x);
}

/// exp(x) - 1 without loss for small x.
inline Pack expm1(Pack x) noexcept {
  const Pack inside = select(x > 710.0, Pack(710.0), select(x < -60.0, Pack(-60.0), x));
  Pack k;
  const Pack p = detail::expm1_reduced(inside, k);
  const Pack half_scale = detail::power_of_two(k - 1.0);
  const Pack finite = 2.0 * (p * half_scale + (half_scale - 0.5));
  return select(x == x, select(k == 0.0, p, finite), x);
}

namespace detail {
/// Lanes in [1/2, 4), where the root needs no scaling.
inline bool needs_no_scaling(Pack x) noexcept {
  return all((x >= 0.5) & (x < 4.0));
}

/// x = m 2^(3 third) with m in [1/2, 4), for normal x > 0.
inline Pack scaled_by_thirds(Pack x, Pack& third) noexcept {
  const Bits exponent = difference(bits(x), one_bits) >> 52;
  const Pack e = to_double(exponent), mantissa = from_bits(difference(bits(x), exponent << 52));
  third = nearest_integer(e * (1.0 / 3.0));
  return mantissa * power_of_two(e - 3.0 * third);
}

/// m^(-1/3) of m in [1/2, 4) to a few units in the last place.
inline Pack reduced_reciprocal_cbrt(Pack m) noexcept {
  // y -> m^(-1/3): y (1 - h)^(-1/3) with h = 1 - m y^3, first from a cubic fit (2.6 %), then to 6e-6 and below rounding. Products
  // are paired so that few of them wait for each other.
  Pack y = (1.518645700691947 + m * -0.6744191525243759) + (m * m) * (0.19491008005708438 + m * -0.020547832477409447);
  Pack h = 1.0 - (m * y) * (y * y);
  y += (y * h) * (1.0 / 3 + h * (2.0 / 9 + h * (14.0 / 81)));
  h = 1.0 - (m * y) * (y * y);
  return y + (y * h) * (1.0 / 3 + h * (2.0 / 9));
}

[[gnu::noinline]] inline Pack reciprocal_cbrt_of_any(Pack x) noexcept {
  Pack third;
  const Pack y = reduced_reciprocal_cbrt(scaled_by_thirds(x, third));
  return select(x == x, y * power_of_two(-third), x);
}
}  // namespace detail

/// x^(-1/3) of normal x > 0 to a few units in the last place; not a number where x is none.
inline Pack reciprocal_cbrt(Pack x) noexcept {
  if (detail::needs_no_scaling(x)) [[likely]]
    return detail::reduced_reciprocal_cbrt(x);
  return detail::reciprocal_cbrt_of_any(x);
}

inline Pack cbrt(Pack x) noexcept {
  const Pack magnitude = abs(x);
  const PackMask subnormal = magnitude < std::numeric_limits<double>::min();
  const Pack scaled = select(subnormal, magnitude * 0x1p54, magnitude);
  Pack m = scaled, third = 0.0;
  if (!detail::needs_no_scaling(scaled)) m = detail::scaled_by_thirds(scaled, third);
  const Pack y = detail::reduced_reciprocal_cbrt(m);
  Pack root = m * y * y;
  root += (m - root * root * root) * (y * y) * (1.0 / 3);
  const Pack result = root * detail::power_of_two(third + select(subnormal, Pack(-18.0), Pack(0.0)));
  const Pack signed_result = select(x < 0.0, -result, result);
  return select((magnitude > 0.0) & (magnitude < detail::infinity), signed_result, x);
}

inline Pack tanh(Pack x) noexcept {
  const Pack e = expm1(2.0 * min(abs(x), Pack(20.0))), size = e / (e + 2.0);
  return select(abs(x) > 0.0, select(x < 0.0, -size, size), x);   // else x is 0 or not a number
}

/// x^exponent for |exponent| < 2^51; of x < 0 with whole exponents alone. Its relative error is |ln(x^exponent)| + 2 units in the last place: where
/// the exponent is known when compiling, rational_power below is more exact and quicker.
inline Pack pow(Pack x, Pack exponent) noexcept {
  const Pack size = exp(exponent * log(abs(x))), half = 0.5 * exponent;
  const PackMask whole = detail::nearest_integer(exponent) == exponent, odd = detail::nearest_integer(half) != half;
  const Pack of_negative = select(whole, select(odd, -size, size), Pack(detail::not_a_number));
  return select((exponent == 0.0) | (x == 1.0), Pack(1.0), select(x < 0.0, of_negative, size));
}
/// x^n for a whole number n, by multiplication.
template <std::integral N>
Pack pow(Pack x, N n) noexcept {
  Pack power = 1.0;
  for (auto left = n < 0 ? -static_cast<long long>(n) : static_cast<long long>(n); left != 0; left /= 2, x *= x)
    if (left % 2 != 0) power *= x;
  return n < 0 ? Pack(1.0) / power : power;
}

/// x^N for a constant integer N.
template <int N, class T>
T integer_power(const T& x) noexcept {
  if constexpr (N < 0)
    return T(1.0) / integer_power<-N>(x);
  else if constexpr (N == 0)
    return T(1.0);
  else if constexpr (N == 1)
    return x;
  else if constexpr (N % 2 == 0)
    return integer_power<N / 2>(T(x * x));
  else
    return x * integer_power<N - 1>(x);
}
template <int N>
Pack integer_power(const Product& x) noexcept {
  return integer_power<N>(Pack(x));
}

/// x^(N/D) for a constant exponent, D = 1, 2 or 3; x > 0 unless D = 1. To 2 units in the last place for exponents in [-1, 1], 3
/// in
/// [-2, 2].
template <int N, int D, class T>
T rational_power(const T& x) noexcept {
  static_assert(D >= 1 && D <= 3, "whole, half and third powers");
  // x^q times a small power of the root, so that the root's error is not multiplied
  if constexpr (D == 1) {
    return integer_power<N>(x);
  } else {
    constexpr int q = D == 2 ? (N >= 0 ? N / 2 : -((-N + 1) / 2)) : (N >= 0 ? (N + 1) / 3 : -((-N + 1) / 3));
    constexpr int rest = N - q * D;  // 0, 1; for thirds also -1
    T root;
    if constexpr (D == 2)
      root = sqrt(x);
    else
      root = cbrt(x);
    if constexpr (rest == 0)
      return integer_power<q>(x);
    else if constexpr (rest > 0 && q < 0)
      return root / integer_power<-q>(x);
    else if constexpr (rest > 0)
      return root * integer_power<q>(x);
    else if constexpr (q >= 0)
      return integer_power<q>(x) / root;
    else
      return T(1.0) / (root * integer_power<-q>(x));
  }
}

template <int N, int D>
Pack rational_power(const Product& x) noexcept {
  return rational_power<N, D>(Pack(x));
}

}  // namespace perikit
