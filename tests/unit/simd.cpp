/// Packs lane by lane: what is done to a register gives each lane what it says, and leaves the others alone.

#include "perikit/core/simd.hpp"

#include <doctest/doctest.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

using namespace perikit;

namespace {

using Lanes = std::array<double, pack_width>;
constexpr int combinations = 1 << pack_width;

/// first, first + 1, ...
Lanes from(double first) {
  Lanes lanes;
  for (double& x : lanes) x = first++;
  return lanes;
}
Pack packed(const Lanes& lanes) { return Pack::load(lanes.data()); }
Lanes lanes_of(Pack a) {
  Lanes lanes;
  a.store(lanes.data());
  return lanes;
}

}  // namespace

TEST_CASE("packs: lanes that bits keep") {
  const Lanes a = from(1);
  for (int bits = 0; bits < combinations; ++bits) {
    const Lanes kept = lanes_of(keep(static_cast<std::uint8_t>(bits), packed(a)));
    for (std::size_t l = 0; l < pack_width; ++l) CHECK(kept[l] == ((bits >> l & 1) != 0 ? a[l] : 0.0));
  }
  // What is left out may be anything, and bits beyond the pack are those of other lanes.
  Lanes wrong;
  wrong.fill(std::numeric_limits<double>::quiet_NaN());
  CHECK(lanes_of(keep(0, packed(wrong))) == Lanes{});
  CHECK(lanes_of(keep(0xff, packed(a))) == a);
}

TEST_CASE("packs: differences where bits say so, and nothing else written") {
  for (int bits = 0; bits < combinations; ++bits) {
    std::array<double, pack_width + 2> memory;
    memory.fill(100.0);
    subtract_at(memory.data() + 1, static_cast<std::uint8_t>(bits), packed(from(1)));
    for (std::size_t l = 0; l < memory.size(); ++l) {
      const bool inside = l >= 1 && l <= pack_width && (bits >> (l - 1) & 1) != 0;
      CHECK(memory[l] == (inside ? 100.0 - static_cast<double>(l) : 100.0));
    }
  }
}

TEST_CASE("packs: comparisons, choices, any and all") {
  const Lanes a = from(0);
  for (int n = 0; n <= pack_width; ++n) {
    const PackMask below = packed(a) < Pack(static_cast<double>(n));
    CHECK(lane_bits(below) == (1u << n) - 1);
    CHECK(any(below) == (n > 0));
    CHECK(all(below) == (n == pack_width));
    CHECK(lane_bits(!below) == (combinations - 1u) - ((1u << n) - 1));
    const Lanes chosen = lanes_of(select(below, Pack(-1.0), Pack(-2.0)));
    for (int l = 0; l < pack_width; ++l) {
      CHECK(below[l] == (l < n));
      CHECK(chosen[static_cast<std::size_t>(l)] == (l < n ? -1.0 : -2.0));
    }
  }
}

TEST_CASE("packs: reads from anywhere, transposes and sums") {
  std::array<double, 64> memory;
  for (std::size_t k = 0; k < memory.size(); ++k) memory[k] = static_cast<double>(k * k);
  std::array<std::int32_t, pack_width> at;
  for (int l = 0; l < pack_width; ++l) at[static_cast<std::size_t>(l)] = (17 * l + 5) % 64;
  const Lanes gathered = lanes_of(gather(memory.data(), at.data()));
  for (std::size_t l = 0; l < pack_width; ++l) CHECK(gathered[l] == memory[static_cast<std::size_t>(at[l])]);

  Pack rows[pack_width];
  for (int i = 0; i < pack_width; ++i) rows[i] = packed(from(10.0 * i));
  transpose(rows);
  for (int i = 0; i < pack_width; ++i)
    for (int j = 0; j < pack_width; ++j) CHECK(rows[i][j] == 10.0 * j + i);

  CHECK(sum(packed(from(1))) == 0.5 * pack_width * (pack_width + 1));
  for (int n = 0; n <= pack_width; ++n) {
    const Lanes first = lanes_of(Pack::load_first(memory.data() + 1, n));
    for (int l = 0; l < pack_width; ++l) CHECK(first[static_cast<std::size_t>(l)] == (l < n ? memory[static_cast<std::size_t>(l + 1)] : 0.0));
  }
}

TEST_CASE("packs: roots and signs") {
  const Lanes roots = lanes_of(sqrt(packed(from(1)) * packed(from(1))));
  CHECK(roots == from(1));
  CHECK(lanes_of(abs(-packed(from(1)))) == from(1));
  CHECK(std::signbit((-Pack(0.0))[0]));
  CHECK(std::signbit(Pack(-0.0)[0]));
  CHECK(lanes_of(min(packed(from(-1)), Pack(0.0)))[0] == -1.0);
  CHECK(lanes_of(max(packed(from(-1)), Pack(0.0)))[0] == 0.0);
}

TEST_CASE("packs: sums over eight lanes have one order, whatever the width of a pack is") {
  const std::array<double, 16> a = {1e16, 1, -1e16, 1, 3, 1e-3, 7, -2, 1, 1e16, 1, -1e16, 1e-3, 5, -7, 2};
  EightSums sums;
  for (int l = 0; l < 16; l += pack_width) sums.at(l) += Pack::load(a.data() + l);
  double total = 0;
  for (std::size_t l = 0; l < 8; ++l) total += a[l] + a[l + 8];
  CHECK(sums.total() == total);
}

#if defined(__FMA__) || defined(__aarch64__)
TEST_CASE("packs: a product is not rounded before it is added, wherever it stands") {
  const double a = 1 + 0x1p-30, b = 1 - 0x1p-30, c = 3 + 0x1p-40, d = 1.0 / 3;   // a b = 1 - 2^-60, which rounds to 1
  const Pack A(a), B(b), C(c), D(d);
  const auto first = [](Pack x) { return x[0]; };
  CHECK(first(A * B - Pack(1.0)) == -0x1p-60);
  CHECK(first(Pack(1.0) - A * B) == 0x1p-60);
  CHECK(first(Pack(-1.0) + A * B) == -0x1p-60);
  CHECK(first(A * B + C * D) == std::fma(a, b, c * d));
  CHECK(first(A * B - C * D) == std::fma(a, b, -(c * d)));
  CHECK(first(-(A * B) + Pack(1.0)) == 0x1p-60);
  Pack sum(-1.0);
  sum += A * B;
  CHECK(sum[0] == -0x1p-60);
  CHECK((Pack(A * B) - Pack(1.0))[0] == 0.0);
}

// In scalars, operation by operation: what every level with fused operations computes.
TEST_CASE("packs: reciprocals and roots are the same numbers at every level") {
  const auto guess = [](std::uint64_t constant, double x, int shift) {
    return std::bit_cast<double>(constant - (std::bit_cast<std::uint64_t>(x) >> shift));
  };
  double x = 1.2345e-200;
  for (int n = 0; n < 2000; ++n, x *= 1.6180339887) {
    double r = guess(0x7fde663822fc16e6, x, 0);
    r *= std::fma(-x, r, 2.0013);
    r *= std::fma(-x, r, 2.0000008455);
    const double e = std::fma(-x, r, 1.0);
    CHECK(reciprocal(Pack(x))[0] == std::fma(r, std::fma(e, e, e), r));
    double q = guess(0x5fe4075000000000, x, 1);
    const double t = (x * q) * q;
    q *= std::fma(t, std::fma(t, 0.65922143, -1.7546571), 2.0998561);
    const double f = std::fma(-(x * q), q, 1.0);
    CHECK(reciprocal_root(Pack(x))[0] == std::fma(q * f, std::fma(f, std::fma(0.3125, f, 0.375), 0.5), q));
  }
}
#endif
