/// Packs lane by lane: what is done to a register gives each lane what it says, and leaves the others alone.

#include "perikit/core/simd.hpp"

#include <doctest/doctest.h>

#include <array>
#include <cmath>
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
