#pragma once
/// Forward differentiation: a number with one derivative. Dual<Pack> carries eight points at once, Dual<Dual<T>> second
/// derivatives.

#include <concepts>
#include <type_traits>

#include "perikit/core/simd_math.hpp"

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

// Comparisons look at the value.
template <class T, class U>
auto operator<(Dual<T> a, U b) noexcept {
  return a.value < b;
}
template <class T, class U>
auto operator>(Dual<T> a, U b) noexcept {
  return a.value > b;
}

template <class M, class T>
Dual<T> select(M mask, Dual<T> a, Dual<T> b) noexcept {
  return {select(mask, a.value, b.value), select(mask, a.derivative, b.derivative)};
}

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
Dual<T> abs(Dual<T> x) noexcept {
  return select(x.value < T(0.0), -x, x);
}

}  // namespace perikit
