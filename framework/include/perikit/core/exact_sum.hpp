#pragma once
/// Sums of doubles without rounding, so that neither the order of the terms nor who adds them matters: any threads, any ranks,
/// the same bits. A long fixed-point number with a limb for every 32 bits of the range of a double [Neal 2015, Fast exact
/// summation using small and large superaccumulators].

#include <array>
#include <bit>
#include <cstdint>

namespace perikit {

class ExactSum {
 public:
  /// 2^-1074 ... 2^1024 in steps of 32 bits, and two for carries.
  static constexpr std::size_t limbs = 69;
  /// Plain numbers, which add limb by limb where `normalize` has been called before: for sums over ranks. The last one counts
  /// terms that are no finite numbers.
  using Limbs = std::array<std::int64_t, limbs + 1>;

  void add(double x) noexcept {
    const auto bits = std::bit_cast<std::uint64_t>(x);
    const auto exponent = static_cast<std::uint32_t>(bits >> 52 & 0x7ff);
    if (exponent == 0x7ff) {
      ++limb_[limbs];
      return;
    }
    const std::uint64_t fraction = bits & ((std::uint64_t{1} << 52) - 1);
    // Subnormal numbers have the exponent of the smallest normal ones, without the leading bit.
    const std::uint64_t mantissa = exponent == 0 ? fraction : fraction | std::uint64_t{1} << 52;
    const std::uint32_t place = exponent == 0 ? 0 : exponent - 1, shift = place & 31;
    const auto low = static_cast<std::int64_t>(mantissa << shift & 0xffffffff);
    const auto high = static_cast<std::int64_t>(mantissa >> (32 - shift));
    const std::int64_t sign = static_cast<std::int64_t>(bits) >> 63;  // 0 or -1
    limb_[place / 32] += (low ^ sign) - sign;
    limb_[place / 32 + 1] += (high ^ sign) - sign;
    if (++pending_ == most_pending) normalize();
  }
  void add(const ExactSum& other) noexcept;

  /// So many terms at once, which are used up; the last ones may be 0.
  static constexpr std::size_t group = 512;
  using Group = std::array<double, group>;
  void add(Group& terms) noexcept;

  /// Every limb but the topmost below 2^32 and not negative.
  void normalize() noexcept;
  Limbs& numbers() noexcept { return limb_; }
  /// Rounded to the nearest double, ties to even; no number where a term was none or infinite.
  double value() const noexcept;

 private:
  /// Each term adds less than 2^53 to a limb.
  static constexpr int most_pending = 512;
  Limbs limb_{};
  int pending_ = 0;
};

}  // namespace perikit
