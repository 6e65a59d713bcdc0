/// Keyed rows of several ranks come in the order of their keys, and no rank ever has more than a piece of them.

#include "core/ranks/merged_rows.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <random>
#include <stdexcept>

#include "tests/thread_ranks.hpp"

using namespace perikit;

namespace {

struct Result {
  std::vector<std::int64_t> keys;
  std::vector<double> rows;
  std::size_t largest = 0, pieces = 0;
};

/// rank_of(key): who has it. Rows are (key, -key).
template <class RankOf>
Result merged(int ranks, const std::vector<std::int64_t>& keys, std::size_t most, RankOf&& rank_of) {
  Result result;
  on_ranks(ranks, [&](ThreadRank& rank) {
    std::vector<std::int64_t> mine;
    std::ranges::copy_if(keys, std::back_inserter(mine), [&](std::int64_t key) { return rank_of(key) == rank.rank(); });
    std::vector<double> rows;
    const auto rows_of = [&](std::size_t from, std::size_t to) {
      rows.clear();
      for (std::size_t k = from; k < to; ++k)
        rows.insert(rows.end(), {static_cast<double>(mine[k]), -static_cast<double>(mine[k])});
      return std::span<const double>(rows);
    };
    over_merged_rows(
        std::span<const std::int64_t>(mine), 2, rows_of,
        [&](std::span<const std::int64_t> piece, std::span<const double> values) {
          CHECK(rank.rank() == 0);
          CHECK(values.size() == 2 * piece.size());
          result.keys.insert(result.keys.end(), piece.begin(), piece.end());
          result.rows.insert(result.rows.end(), values.begin(), values.end());
          result.largest = std::max(result.largest, piece.size());
          ++result.pieces;
        },
        most);
  });
  return result;
}

}  // namespace

TEST_CASE("merged rows: all keys once, in order, with their rows, a piece at a time") {
  std::mt19937_64 random(5);
  std::vector<std::int64_t> keys;
  for (std::int64_t key = 0; key < 3000; key += 1 + static_cast<std::int64_t>(random() % 7)) keys.push_back(key);
  const auto check = [&](int ranks, std::size_t most, const char* what, auto&& rank_of) {
    INFO(std::string(what), ", ", ranks, " ranks, ", most, " keys at a time");
    const Result result = merged(ranks, keys, most, rank_of);
    CHECK(result.keys == keys);
    bool right = result.rows.size() == 2 * keys.size();
    for (std::size_t k = 0; right && k < keys.size(); ++k)
      right = result.rows[2 * k] == static_cast<double>(keys[k]) && result.rows[2 * k + 1] == -static_cast<double>(keys[k]);
    CHECK(right);
    CHECK(result.largest <= std::max<std::size_t>(most, static_cast<std::size_t>(ranks)));
    CHECK(result.pieces >= keys.size() / std::max<std::size_t>(most, static_cast<std::size_t>(ranks)));
  };
  for (const int ranks : {1, 2, 5})
    for (const std::size_t most : {1, 7, 100, 100000}) {
      check(ranks, most, "in turn", [&](std::int64_t key) { return static_cast<int>(key % ranks); });
      check(ranks, most, "one after the other", [&](std::int64_t key) { return static_cast<int>(key * ranks / 3000); });
      check(ranks, most, "all on the last one", [&](std::int64_t) { return ranks - 1; });
    }
}

TEST_CASE("ranks: what one throws while the others meet ends them all, and is what is thrown") {
  for (const int thrower : {0, 2}) {
    const auto work = [&](ThreadRank& rank) {
      std::vector<std::int64_t> numbers(4, 1);
      rank.sum(numbers);
      CHECK(numbers == std::vector<std::int64_t>(4, 3));
      if (rank.rank() == thrower) throw std::runtime_error("it alone");
      numbers.resize(5);
      rank.sum(numbers);
    };
    CHECK_THROWS_WITH(on_ranks(3, work), "it alone");
  }
}
