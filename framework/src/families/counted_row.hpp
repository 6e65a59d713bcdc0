#pragma once
/// Rows of loops over clouds that count their operations, one each component: for builds with PERIKIT_COUNT_OPERATIONS.

#include "perikit/core/simd.hpp"

namespace perikit {

struct alignas(32) CountedRow {
  double x[4];

  double& operator[](std::size_t c) noexcept { return x[c]; }
  double operator[](std::size_t c) const noexcept { return x[c]; }
  template <class Op>
  static CountedRow each(Op&& op) noexcept {
    detail::count(4);
    return {op(0), op(1), op(2), op(3)};
  }
  friend CountedRow operator+(const CountedRow& a, const CountedRow& b) noexcept { return each([&](int c) { return a.x[c] + b.x[c]; }); }
  friend CountedRow operator-(const CountedRow& a, const CountedRow& b) noexcept { return each([&](int c) { return a.x[c] - b.x[c]; }); }
  friend CountedRow operator*(const CountedRow& a, const CountedRow& b) noexcept { return each([&](int c) { return a.x[c] * b.x[c]; }); }
  friend CountedRow operator*(const CountedRow& a, double b) noexcept { return each([&](int c) { return a.x[c] * b; }); }
  friend CountedRow operator*(double a, const CountedRow& b) noexcept { return b * a; }
  friend CountedRow operator-(const CountedRow& a) noexcept { return {-a.x[0], -a.x[1], -a.x[2], -a.x[3]}; }
  CountedRow& operator+=(const CountedRow& b) noexcept { return *this = *this + b; }
  CountedRow& operator-=(const CountedRow& b) noexcept { return *this = *this - b; }
  CountedRow& operator*=(double b) noexcept { return *this = *this * b; }
};

}  // namespace perikit
