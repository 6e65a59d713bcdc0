#pragma once
/// Rows of loops over clouds that count their operations, one each component: for builds with PERIKIT_COUNT_OPERATIONS.

#include "perikit/core/simd.hpp"

namespace perikit {

struct alignas(32) OperationCountingRow {
  double x[4];

  double& operator[](std::size_t c) noexcept { return x[c]; }
  double operator[](std::size_t c) const noexcept { return x[c]; }
  template <class Op>
  static OperationCountingRow each(Op&& op) noexcept {
    detail::count(4);
    return {op(0), op(1), op(2), op(3)};
  }
  friend OperationCountingRow operator+(const OperationCountingRow& a, const OperationCountingRow& b) noexcept { return each([&](int c) { return a.x[c] + b.x[c]; }); }
  friend OperationCountingRow operator-(const OperationCountingRow& a, const OperationCountingRow& b) noexcept { return each([&](int c) { return a.x[c] - b.x[c]; }); }
  friend OperationCountingRow operator*(const OperationCountingRow& a, const OperationCountingRow& b) noexcept { return each([&](int c) { return a.x[c] * b.x[c]; }); }
  friend OperationCountingRow operator*(const OperationCountingRow& a, double b) noexcept { return each([&](int c) { return a.x[c] * b; }); }
  friend OperationCountingRow operator*(double a, const OperationCountingRow& b) noexcept { return b * a; }
  friend OperationCountingRow operator-(const OperationCountingRow& a) noexcept { return {-a.x[0], -a.x[1], -a.x[2], -a.x[3]}; }
  OperationCountingRow& operator+=(const OperationCountingRow& b) noexcept { return *this = *this + b; }
  OperationCountingRow& operator-=(const OperationCountingRow& b) noexcept { return *this = *this - b; }
  OperationCountingRow& operator*=(double b) noexcept { return *this = *this * b; }
};

}  // namespace perikit
