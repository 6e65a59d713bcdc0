#pragma once
/// Forward differentiation: a number with one derivative. Dual<Pack> carries eight points at once, Dual<Dual<T>> second
/// derivatives.

#include <concepts>
#include <type_traits>

#include "perikit/core/simd_math.hpp"
#include "perikit/core/standard_functions.hpp"

namespace perikit {

template <class T>
struct Dual {
  T value{};
  T derivative{};

  Dual() = default;
  Dual(T v, T d) noexcept : value(v), derivative(d) {}
  /// A constant.
  template <class U>
  requires(std::convertible_to<U, T> && !std::same_as<U, Dual>) Dual(U constant)
  noexcept : value(static_cast<T>(constant)), derivative(0.0) {}

  friend Dual operator+(Dual a, Dual b) noexcept { return {a.value + b.value, a.derivative + b.derivative}; }
  friend Dual operator-(Dual a, Dual b) noexcept { return {a.value - b.value, a.derivative - b.derivative}; }
  friend Dual operator-(Dual a) noexcept { return {-a.value, -a.derivative}; }
  friend Dual operator*(Dual a, Dual b) noexcept { return {a.value * b.value, a.value * b.derivative + a.derivative * b.value}; }
  friend Dual operator/(Dual a, Dual b) noexcept {
    const T quotient = a.value / b.value;
    return {quotient, (a.derivative - quotient * b.derivative) / b.value};
  }
  Dual& operator+=(Dual b) noexcept { return *this = *this + b; }
  Dual& operator-=(Dual b) noexcept { return *this = *this - b; }
  Dual& operator*=(Dual b) noexcept { return *this = *this * b; }
  Dual& operator/=(Dual b) noexcept { return *this = *this / b; }
};

/// What a Dual is not, but can be combined with: its own T, and whatever T can be made from.
template <class U, class T>
concept ConstantFor = std::convertible_to<U, T> && !std::same_as<std::remove_cvref_t<U>, Dual<T>>;

// Constants apart: the compiler may not drop the products with their zero derivatives by itself.
template <class T, ConstantFor<T> U>
Dual<T> operator+(Dual<T> a, U b) noexcept {
  return {a.value + T(b), a.derivative};
}
template <class T, ConstantFor<T> U>
Dual<T> operator+(U a, Dual<T> b) noexcept {
  return {T(a) + b.value, b.derivative};
}
template <class T, ConstantFor<T> U>
Dual<T> operator-(Dual<T> a, U b) noexcept {
  return {a.value - T(b), a.derivative};
}
template <class T, ConstantFor<T> U>
Dual<T> operator-(U a, Dual<T> b) noexcept {
  return {T(a) - b.value, -b.derivative};
}
template <class T, ConstantFor<T> U>
Dual<T> operator*(Dual<T> a, U b) noexcept {
  return {a.value * b, a.derivative * b};
}
template <class T, ConstantFor<T> U>
Dual<T> operator*(U a, Dual<T> b) noexcept {
  return {a * b.value, a * b.derivative};
}
template <class T, ConstantFor<T> U>
Dual<T> operator/(Dual<T> a, U b) noexcept {
  return {a.value / b, a.derivative / b};
}

namespace detail {
template <class T>
inline constexpr bool is_dual = false;
template <class T>
inline constexpr bool is_dual<Dual<T>> = true;

/// The number without its derivatives.
template <class T>
const T& value(const T& x) noexcept {
  return x;
}
template <class T>
decltype(auto) value(const Dual<T>& x) noexcept {
  return value(x.value);
}
}  // namespace detail

/// Two scalars, at least one of them a Dual, the other one its like or a constant for it.
template <class A, class B>
concept DualWith = (detail::is_dual<A> || detail::is_dual<B>) && (std::convertible_to<A, B> || std::convertible_to<B, A>);
/// That of both which the other one can be made to.
template <class A, class B>
using Joint = std::conditional_t<std::convertible_to<B, A>, A, B>;

// Comparisons look at the value. They give what those of the values give: a bool, or a mask of packs.
template <class A, class B>
requires DualWith<A, B>
auto operator<(const A& a, const B& b) noexcept { return detail::value(a) < detail::value(b); }
template <class A, class B>
requires DualWith<A, B>
auto operator<=(const A& a, const B& b) noexcept { return detail::value(a) <= detail::value(b); }
template <class A, class B>
requires DualWith<A, B>
auto operator>(const A& a, const B& b) noexcept { return detail::value(a) > detail::value(b); }
template <class A, class B>
requires DualWith<A, B>
auto operator>=(const A& a, const B& b) noexcept { return detail::value(a) >= detail::value(b); }
template <class A, class B>
requires DualWith<A, B>
auto operator==(const A& a, const B& b) noexcept { return detail::value(a) == detail::value(b); }
template <class A, class B>
requires DualWith<A, B>
auto operator!=(const A& a, const B& b) noexcept { return detail::value(a) != detail::value(b); }

template <class M, class A, class B>
requires DualWith<A, B>
Joint<A, B> select(M mask, const A& a, const B& b) noexcept {
  const Joint<A, B> x = a, y = b;
  return {select(mask, x.value, y.value), select(mask, x.derivative, y.derivative)};
}
// Where both are equal: the second, with its derivative.
template <class A, class B>
requires DualWith<A, B>
Joint<A, B> min(const A& a, const B& b) noexcept { return select(a < b, a, b); }
template <class A, class B>
requires DualWith<A, B>
Joint<A, B> max(const A& a, const B& b) noexcept { return select(a > b, a, b); }

template <class T>
Dual<T> sqrt(Dual<T> x) noexcept {
  const T root = sqrt(x.value);
  return {root, x.derivative * 0.5 / root};
}
template <class T>
Dual<T> reciprocal(Dual<T> x) noexcept {
  const T inverse = reciprocal(x.value);
  return {inverse, -(x.derivative * (inverse * inverse))};
}
template <class T>
Dual<T> cbrt(Dual<T> x) noexcept {
  const T root = cbrt(x.value);
  return {root, x.derivative * root / (3.0 * x.value)};
}
template <class T>
Dual<T> reciprocal_cbrt(Dual<T> x) noexcept {
  const T root = reciprocal_cbrt(x.value), square = root * root;
  return {root, x.derivative * (square * square) * (-1.0 / 3)};
}
template <class T>
Dual<T> log(Dual<T> x) noexcept {
  return {log(x.value), x.derivative / x.value};
}
template <class T>
Dual<T> log1p(Dual<T> x) noexcept {
  return {log1p(x.value), x.derivative / (1.0 + x.value)};
}
template <class T>
Dual<T> exp(Dual<T> x) noexcept {
  const T e = exp(x.value);
  return {e, x.derivative * e};
}
template <class T>
Dual<T> expm1(Dual<T> x) noexcept {
  const T e = expm1(x.value);
  return {e, x.derivative * (e + 1.0)};
}
template <class T>
Dual<T> tanh(Dual<T> x) noexcept {
  const T t = tanh(x.value);
  return {t, x.derivative * (1.0 - t * t)};
}
template <class T, ConstantFor<T> U>
Dual<T> pow(Dual<T> x, U exponent) noexcept {
  return {pow(x.value, exponent), x.derivative * (exponent * pow(x.value, exponent - 1))};
}
template <class T, ConstantFor<T> U>
Dual<T> pow(U x, Dual<T> exponent) noexcept {
  const T power = pow(T(x), exponent.value);
  return {power, exponent.derivative * (power * log(T(x)))};
}
/// x > 0
template <class T>
Dual<T> pow(Dual<T> x, Dual<T> exponent) noexcept {
  const T power = pow(x.value, exponent.value);
  return {power, power * (exponent.derivative * log(x.value) + x.derivative * (exponent.value / x.value))};
}
template <class T>
Dual<T> abs(Dual<T> x) noexcept {
  return select(x < 0.0, -x, x);
}

}  // namespace perikit
