/// Rows of points in packs, as loops over the bonds of clouds use them.

#include "families/cloud/cloud_row_simd.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>

using namespace perikit;

namespace {

/// Row k is {10 k, 10 k + 1, 10 k + 2, 10 k + 3}.
AlignedVector<Row> numbered_rows(int count) {
  AlignedVector<Row> rows(static_cast<std::size_t>(count));
  for (int k = 0; k < count; ++k)
    for (int c = 0; c < 4; ++c) rows[static_cast<std::size_t>(k)][c] = 10 * k + c;
  return rows;
}

std::array<double, 4> values(const Row& row) { return {row[0], row[1], row[2], row[3]}; }

using Four = std::array<double, 4>;

}  // namespace

TEST_CASE("row packs: two rows side by side") {
  const AlignedVector<Row> rows = numbered_rows(4);
  const TwoRows pair = TwoRows::load(rows[3], rows[1]);
  CHECK(values(pair.sum()) == Four{40, 42, 44, 46});
  CHECK(values((pair - TwoRows::load(rows[1], rows[2])).sum()) == Four{10, 10, 10, 10});
  CHECK(values((pair + pair).sum()) == Four{80, 84, 88, 92});
  CHECK(values(TwoRows::fill(2, 5).sum()) == Four{7, 7, 7, 7});
  // Each row times its own component.
  CHECK(values((pair * pair.spread<0>()).sum()) == Four{30 * 30 + 10 * 10, 30 * 31 + 10 * 11, 30 * 32 + 10 * 12, 30 * 33 + 10 * 13});
  CHECK(values((TwoRows::fill(1, 0) * pair.spread<1>()).sum()) == Four{31, 31, 31, 31});
  CHECK(values((TwoRows::fill(0, 1) * pair.spread<2>()).sum()) == Four{12, 12, 12, 12});
  CHECK(values((TwoRows::fill(1, 1) * pair.spread<3>()).sum()) == Four{46, 46, 46, 46});
  TwoRows sum = pair;
  sum.add_product(TwoRows::fill(1, 2), pair);
  CHECK(values(sum.sum()) == Four{60 + 30, 62 + 33, 64 + 36, 66 + 39});
}

TEST_CASE("row packs: rows by component, and back") {
  constexpr int stride = 3;
  AlignedVector<Row> rows = numbered_rows(stride * pack_width);
  std::array<std::int32_t, pack_width> at{};
  for (int l = 0; l < pack_width; ++l) at[static_cast<std::size_t>(l)] = (3 * l + 1) % pack_width;  // every one once
  const RowColumns columns = RowColumns::load(rows.data() + 1, at.data(), stride);
  Four total{};
  for (int l = 0; l < pack_width; ++l)
    for (int c = 0; c < 4; ++c) {
      const double expected = 10 * (stride * at[static_cast<std::size_t>(l)] + 1) + c;
      CHECK(columns[c][l] == expected);
      total[static_cast<std::size_t>(c)] += expected;
    }
  CHECK(values(columns.sum_after(Row{})) == total);
  for (int n = 0; n <= pack_width; ++n) {
    AlignedVector<Row> sums = numbered_rows(stride * pack_width);
    columns.add_to(sums.data() + 1, at.data(), n, stride);
    for (int k = 0; k < stride * pack_width; ++k) {
      const auto lane = std::find(at.begin(), at.begin() + n, k / stride);
      const double factor = k % stride == 1 && lane != at.begin() + n ? 2 : 1;
      for (int c = 0; c < 4; ++c) {
        const double sum = sums[static_cast<std::size_t>(k)][c];
        CHECK(sum == factor * (10 * k + c));
      }
    }
  }
}

TEST_CASE("row packs: bits of lanes") {
  CHECK(first_lanes(-3) == 0);
  CHECK(first_lanes(1) == 1);
  CHECK(first_lanes(pack_width + 5) == (1 << pack_width) - 1);
  for (int n = 0; n <= pack_width; ++n) {
    Pack lanes(0.0);
    for (int l = 0; l < pack_width; ++l) lanes.v[l] = l;
    CHECK(lane_bits(lanes < Pack(static_cast<double>(n))) == first_lanes(n));
  }
}
