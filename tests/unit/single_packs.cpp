/// Packs of single precision numbers, as the descent to the factors of large clouds uses them.

#include "terms/pairs/single_packs.hpp"

#include <doctest/doctest.h>

#include <algorithm>

using namespace perikit;

TEST_CASE("single packs: rows of points and sums over lanes") {
  // Row k is {10 k, 10 k + 1, 10 k + 2, 10 k + 3}; rows of two points lie side by side.
  constexpr int rows = 80;
  AlignedVector<FourSingles> single(rows);
  AlignedVector<FourDoubles> both(rows);
  for (int k = 0; k < rows; ++k)
    for (int c = 0; c < 4; ++c) both[static_cast<std::size_t>(k)][c] = single[static_cast<std::size_t>(k)][c] = static_cast<float>(10 * k + c);
  std::int32_t at[single_width];
  for (int l = 0; l < single_width; ++l) at[l] = (7 * l + 3) % (rows / 2);
  SinglePack columns[4];
  load_columns(single.data() + 1, at, 2, columns);
  for (int c = 0; c < 4; ++c)
    for (int l = 0; l < single_width; ++l) CHECK(columns[c][l] == static_cast<float>(10 * (2 * at[l] + 1) + c));
  Pack of_doubles[4];
  load_columns(both.data() + 1, at, 2, of_doubles);
  for (int c = 0; c < 4; ++c)
    for (int l = 0; l < pack_width; ++l) CHECK(of_doubles[c][l] == 10 * (2 * at[l] + 1) + c);

}

TEST_CASE("single packs: sums over lanes have one order, whatever the width of a pack is") {
  constexpr int parts = LanesOf<SinglePack>::parts, of_doubles = LanesOf<Pack>::parts;
  static_assert(parts * single_width == 16 && of_doubles * pack_width == 8);
  float singles[4][16];
  double doubles[4][8];
  for (int c = 0; c < 4; ++c)
    for (int l = 0; l < 16; ++l) {
      singles[c][l] = 0.1f * static_cast<float>((37 * l + 11 * c) % 23) + 1e3f * static_cast<float>(l % 3 - 1);
      if (l < 8) doubles[c][l] = static_cast<double>(singles[c][l]) / 3;
    }
  SinglePack columns[parts][4];
  Pack doubled[of_doubles][4];
  for (int c = 0; c < 4; ++c) {
    for (int part = 0; part < parts; ++part) columns[part][c] = SinglePack::load(singles[c] + part * single_width);
    for (int part = 0; part < of_doubles; ++part) doubled[part][c] = Pack::load(doubles[c] + part * pack_width);
  }
  const FourSingles sums = sums_of_lanes(columns);
  const FourDoubles sums_of_doubles = sums_of_lanes(doubled);
  for (int c = 0; c < 4; ++c) {
    const auto quad = [&](int q) { return (singles[c][4 * q] + singles[c][4 * q + 1]) + (singles[c][4 * q + 2] + singles[c][4 * q + 3]); };
    CHECK(sums[c] == (quad(0) + quad(2)) + (quad(1) + quad(3)));
    double sum = 0;
    for (const double lane : doubles[c]) sum += lane;
    CHECK(sums_of_doubles[c] == sum);
  }
}

TEST_CASE("single packs: the first lanes, roots, the larger one and products that are added") {
  float numbers[single_width];
  for (int l = 0; l < single_width; ++l) numbers[l] = static_cast<float>((l + 1) * (l + 1));
  const SinglePack pack = SinglePack::load(numbers);
  for (int n = 0; n <= single_width; ++n) {
    const SinglePack kept = keep_first(n, pack);
    for (int l = 0; l < single_width; ++l) CHECK(kept[l] == (l < n ? numbers[l] : 0.0f));
  }
  const SinglePack root = sqrt(pack), larger = max(pack, SinglePack(5.0)), sum = multiply_add(pack, SinglePack(2.0), SinglePack(1.0));
  for (int l = 0; l < single_width; ++l) {
    CHECK(root[l] == static_cast<float>(l + 1));
    CHECK(larger[l] == std::max(numbers[l], 5.0f));
    CHECK(sum[l] == 2 * numbers[l] + 1);
  }
}
