#pragma once
/// A number that counts the operations done with it, to find out how many a law needs.

#include <cmath>
#include <cstdint>

namespace perikit {

struct Counted {
  double value = 0;
  static inline std::int64_t operations = 0;

  Counted() = default;
  Counted(double v) noexcept : value(v) {}

  friend Counted operator+(Counted a, Counted b) noexcept { return counted(a.value + b.value); }
  friend Counted operator-(Counted a, Counted b) noexcept { return counted(a.value - b.value); }
  friend Counted operator-(Counted a) noexcept { return {-a.value}; }
  friend Counted operator*(Counted a, Counted b) noexcept { return counted(a.value * b.value); }
  friend Counted operator/(Counted a, Counted b) noexcept { return counted(a.value / b.value); }
  Counted& operator+=(Counted b) noexcept { return *this = *this + b; }
  Counted& operator-=(Counted b) noexcept { return *this = *this - b; }
  Counted& operator*=(Counted b) noexcept { return *this = *this * b; }
  friend bool operator<(Counted a, Counted b) noexcept { return a.value < b.value; }
  friend bool operator>(Counted a, Counted b) noexcept { return a.value > b.value; }

  static Counted counted(double v, int n = 1) noexcept {
    operations += n;
    return {v};
  }
};

// Elementary functions count as what their SIMD versions do (perikit/core/simd_math.hpp); choices count nothing.
inline Counted sqrt(Counted a) noexcept { return Counted::counted(std::sqrt(a.value)); }
inline Counted log1p(Counted a) noexcept { return Counted::counted(std::log1p(a.value), 48); }
inline Counted cbrt(Counted a) noexcept { return Counted::counted(std::cbrt(a.value), 46); }
inline Counted abs(Counted a) noexcept { return {std::abs(a.value)}; }
inline Counted min(Counted a, Counted b) noexcept { return a.value < b.value ? a : b; }
inline Counted max(Counted a, Counted b) noexcept { return a.value > b.value ? a : b; }
inline Counted select(bool m, Counted a, Counted b) noexcept { return m ? a : b; }

}  // namespace perikit
