#include "perikit/core/exact_sum.hpp"

#include <cmath>
#include <limits>

#include "perikit/core/simd.hpp"

namespace perikit {

namespace {

constexpr std::int64_t base = std::int64_t{1} << 32;

}  // namespace

void ExactSum::normalize() noexcept {
  for (std::size_t k = 0; k + 1 < limbs; ++k) {
    const std::int64_t carry = limb_[k] >> 32;  // rounds down
    limb_[k] -= carry * base;
    limb_[k + 1] += carry;
  }
  pending_ = 0;
}

void ExactSum::add(const ExactSum& other) noexcept {
  ExactSum theirs = other;
  theirs.normalize();
  for (std::size_t k = 0; k < limb_.size(); ++k) limb_[k] += theirs.limb_[k];
  if (++pending_ >= most_pending) normalize();
}

/// The leading bits of all terms, down to one place, add up without rounding; what is left of the terms is 2^-41 of them at most, and goes the same
/// way until nothing is left [Rump, Ogita, Oishi 2008, Accurate floating-point summation, ExtractVector].
void ExactSum::add(Group& terms) noexcept {
  for (;;) {
    Pack magnitudes(0.0), leading(0.0);
    for (std::size_t k = 0; k < group; k += pack_width) magnitudes += abs(Pack::load(&terms[k]));
    const double bound = sum(magnitudes);
    if (bound == 0) return;
    if (!(bound > 0x1p-900 && bound < 0x1p1000)) break;
    // A power of two of at least four times the bound: neither what is cut off a term nor the sum of all of it is rounded.
    const double cut = std::bit_cast<double>(((std::bit_cast<std::uint64_t>(bound) >> 52) + 3) << 52);
    for (std::size_t k = 0; k < group; k += pack_width) {
      const Pack term = Pack::load(&terms[k]), part = (term + Pack(cut)) - Pack(cut);
      leading += part;
      (term - part).store(&terms[k]);
    }
    add(sum(leading));
  }
  for (const double term : terms) add(term);
}

double ExactSum::value() const noexcept {
  if (limb_[limbs] != 0) return std::numeric_limits<double>::quiet_NaN();
  ExactSum sum = *this;
  sum.normalize();
  const bool negative = sum.limb_[limbs - 1] < 0;
  if (negative) {
    for (std::size_t k = 0; k < limbs; ++k) sum.limb_[k] = -sum.limb_[k];
    sum.normalize();
  }
  std::size_t top = limbs;
  while (top > 0 && sum.limb_[top - 1] == 0) --top;
  if (top == 0) return 0.0;
  // The first 64 bits from the leading one on; what lies below them only decides ties, and one bit below the 53rd says as much.
  const auto limb = [&](std::size_t below) { return top > below ? static_cast<std::uint64_t>(sum.limb_[top - 1 - below]) : 0; };
  const auto zeros = static_cast<unsigned>(std::countl_zero(limb(0))) - 32;  // of 32 bits; the topmost limb has no more
  std::uint64_t leading = (limb(0) << 32 | limb(1)) << zeros | (zeros > 0 ? limb(2) >> (32 - zeros) : 0);
  bool rest = zeros > 0 ? (limb(2) & ((std::uint64_t{1} << (32 - zeros)) - 1)) != 0 : limb(2) != 0;
  for (std::size_t below = 3; below < top && !rest; ++below) rest = limb(below) != 0;
  leading |= rest ? 1 : 0;
  const int exponent = 32 * (static_cast<int>(top) - 2) - static_cast<int>(zeros) - 1074;
  const double magnitude = std::ldexp(static_cast<double>(leading), exponent);
  return negative ? -magnitude : magnitude;
}

}  // namespace perikit
