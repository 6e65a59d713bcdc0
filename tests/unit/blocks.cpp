/// Colours of blocks that scatter at the same time, and blocks that no wave has reached.

#include "families/blocks.hpp"

#include <doctest/doctest.h>

#include <mutex>
#include <set>

#include "families/quiet_blocks.hpp"

using namespace perikit;

namespace {

/// n blocks in a row; each reaches the next ones on both sides.
BlockReach row(int n) {
  BlockReach reach;
  reach.units = static_cast<std::size_t>(n);
  for (int b = 0; b < n; ++b) {
    reach.own.push_back(b);
    auto& units = reach.touches.emplace_back();
    for (int k = std::max(0, b - 1); k <= std::min(n - 1, b + 1); ++k) units.push_back(k);
  }
  return reach;
}

}  // namespace

TEST_CASE("colouring: every block once, and no two of one colour touch the same unit") {
  const BlockReach reach = row(20);
  const Colouring colouring(reach);
  CHECK(colouring.colours() == 3);
  std::mutex guard;
  std::multiset<std::size_t> visited;
  colouring.for_each([&](std::size_t b) {
    const std::lock_guard lock(guard);
    visited.insert(b);
  });
  CHECK(visited.size() == 20);
  for (std::size_t b = 0; b < 20; ++b) CHECK(visited.count(b) == 1);
}

TEST_CASE("colouring: sums into shared units have one order, whatever the number of threads") {
  const BlockReach reach = row(50);
  const Colouring colouring(reach);
  const int threads = thread_count();
  std::vector<double> first;
  for (const int n : {1, 2, 3}) {
    set_thread_count(n);
    std::vector<double> sums(reach.units, 0.0);
    colouring.for_each([&](std::size_t b) {
      for (const std::int32_t unit : reach.touches[b]) sums[static_cast<std::size_t>(unit)] += 1.0 / (3.0 + static_cast<double>(b));
    });
    if (first.empty()) first = sums;
    CHECK(sums == first);
  }
  set_thread_count(threads);
}

TEST_CASE("quiet blocks: pass k reaches k blocks further than what moves") {
  QuietBlocks quiet(row(10));
  quiet.look(3, [](std::size_t b) { return b == 2; });
  for (std::size_t b = 0; b < 10; ++b)
    for (int pass = 1; pass <= 3; ++pass) CHECK(quiet.awake(b, pass) == (b <= 2 + static_cast<std::size_t>(pass) && b + static_cast<std::size_t>(pass) >= 2));
  CHECK(quiet.counts().blocks == 10);
  CHECK(quiet.counts().quiet == 4);
  // What moved before is cleared by the first pass once more.
  quiet.look(3, [](std::size_t) { return false; });
  CHECK(!quiet.awake(2, 3));
  CHECK(quiet.begins(2));
  CHECK(!quiet.begins(9));
}

TEST_CASE("quiet blocks: without them, and after waking, everything is awake") {
  QuietBlocks none;
  none.look(2, [](std::size_t) { return false; });
  CHECK(none.awake(0, 1));
  QuietBlocks quiet(row(4));
  quiet.wake();
  for (std::size_t b = 0; b < 4; ++b) CHECK(quiet.awake(b, 1));
}

TEST_CASE("quiet blocks: laws with a history never sleep again") {
  QuietBlocks quiet(row(10), true);
  quiet.look(1, [](std::size_t b) { return b == 5; });
  quiet.look(1, [](std::size_t) { return false; });
  for (std::size_t b = 0; b < 10; ++b) CHECK(quiet.awake(b, 1) == (b >= 4 && b <= 6));
  quiet.stay_awake();
  quiet.look(1, [](std::size_t) { return false; });
  CHECK(quiet.awake(0, 1));
}
