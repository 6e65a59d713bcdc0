/// Colours of blocks that scatter at the same time, and blocks that no wave has reached.

#include "families/blocks.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <atomic>
#include <map>
#include <mutex>
#include <optional>
#include <random>
#include <set>

#include "core/ranks/dependent_arrival.hpp"
#include "core/threads/loop_order.hpp"
#include "core/threads/loop_times.hpp"
#include "core/threads/work_stealing.hpp"
#include "families/resting_blocks.hpp"
#include "perikit/body/lattice.hpp"
#include "perikit/core/point_motion.hpp"

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

namespace {

/// What comes when somebody has looked for it three times, or waits for it.
class Late final : public Arrival {
 public:
  void start() {
    looks_ = 0;
    there = false;
    expect();
  }
  std::atomic<bool> there = false;

 private:
  bool come(bool wait) override { return wait || ++looks_ > 3; }
  void put() override { there = true; }
  int looks_ = 0;
};

}  // namespace

TEST_CASE("blocks that read what arrives run after it, those that wait for them too, and sums keep their order") {
  BlockReach reach = row(50);
  const int threads = thread_count();
  std::vector<double> wanted(reach.units, 0.0);
  const auto add = [&](std::vector<double>& sums, std::size_t b) {
    for (const std::int32_t unit : reach.touches[b]) sums[static_cast<std::size_t>(unit)] += 1.0 / (3.0 + static_cast<double>(b));
  };
  Colouring(reach).for_each([&](std::size_t b) { add(wanted, b); });
  reach.elsewhere.assign(reach.units, 0);
  reach.elsewhere[0] = reach.elsewhere[1] = reach.elsewhere[49] = 1;
  CHECK(reach.late(2));
  CHECK_FALSE(reach.late(3));
  const Colouring colouring(reach);
  const BlockSequence sequence(reach);
  Late arrival;
  for (const int n : {1, 2, 3}) {
    set_thread_count(n);
    for (int round = 0; round < 20; ++round) {
      std::vector<double> sums(reach.units, 0.0);
      std::atomic<int> before = 0, too_early = 0, visited = 0;
      const auto visit = [&](std::size_t b) {
        ++visited;
        before += !arrival.there;
        too_early += !arrival.there && reach.late(b);
      };
      arrival.start();
      colouring.for_each(
          [&](std::size_t b) {
            visit(b);
            add(sums, b);
          },
          &arrival);
      CHECK(sums == wanted);
      CHECK_FALSE(arrival.pending());
      CHECK(before > 0);
      arrival.start();
      sequence.for_each(visit, &arrival);
      CHECK_FALSE(arrival.pending());
      CHECK(visited == 100);
      CHECK(too_early == 0);
    }
  }
  set_thread_count(threads);
}

namespace {

class Follower final : public DependentArrival {
 public:
  explicit Follower(Late* first) : DependentArrival(first), first_(first) {}
  int put_after = 0, put_before = 0;

 private:
  void put() override { ++(first_->there ? put_after : put_before); }
  Late* first_;
};

}  // namespace

TEST_CASE("what follows something that arrives is put there once, after it") {
  Late first;
  first.start();
  Follower looked(&first);
  for (int look = 0; look < 3; ++look) looked.look();
  CHECK(looked.pending());
  CHECK(looked.put_after == 0);
  looked.look();
  looked.finish();
  CHECK_FALSE(looked.pending());
  CHECK(looked.put_before == 0);
  CHECK(looked.put_after == 1);
  first.start();
  Follower waited(&first);
  waited.finish();
  CHECK(waited.put_before == 0);
  CHECK(waited.put_after == 1);
  // What has arrived before is followed by nothing.
  Follower late(&first);
  CHECK_FALSE(late.pending());
  late.finish();
  CHECK(late.put_after == 0);
  CHECK_FALSE(Follower(nullptr).pending());
}

TEST_CASE("quiet blocks: what is not here yet is looked at where something rests, and counts as moving where nothing does") {
  BlockReach reach = row(6);
  reach.elsewhere.assign(reach.units, 0);
  reach.elsewhere[5] = 1;
  RestingBlocks blocks(reach);
  Late arrival;
  std::vector<std::uint8_t> moving(6, 1);
  const auto moves = [&](std::size_t b) { return moving[b] != 0; };
  arrival.start();
  blocks.look(1, moves, &arrival);
  CHECK(arrival.pending());
  CHECK(blocks.counts().quiet == 0);
  moving = {0, 0, 0, 0, 0, 1};
  blocks.look(1, moves, &arrival);
  CHECK_FALSE(arrival.pending());
  CHECK(blocks.awake(4, 1));
  CHECK_FALSE(blocks.awake(3, 1));
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

TEST_CASE(
    "colours of tiles: families of one colour touch disjoint cells, and there are no more colours than squares in place of discs "
    "take") {
  for (const std::array<int, 3>& extent : {std::array{200, 64, 64}, std::array{80, 10, 10}, std::array{31, 31, 31},
                                           std::array{500, 300, 1}, std::array{9, 9, 9}, std::array{600, 12, 5}})
    for (const std::int64_t cells : {1, 3, 7}) {
      const auto [n0, n1, n2] = extent;
      const Lattice lattice = make_lattice(n2 > 1 ? 3 : 2, 1, {0, 0, 0}, {double(n0), double(n1), double(n2)}, double(cells));
      const LatticeTiling tiling(lattice);
      const std::vector<std::array<int, 3>> offsets = family_offsets(lattice, double(cells));
      const TileColours colours(tiling, offsets);
      std::set<std::array<std::int64_t, 3>> reached{{0, 0, 0}};  // groups along rows, and rows
      for (const auto& d : offsets)
        for (const int side : {-1, 1}) reached.insert({(std::abs(d[0]) + 7) / 8 * side, d[1], d[2]});
      std::map<std::array<std::int64_t, 4>, std::set<std::int64_t>> tiles;  // that touch a cell, by colour and cell
      std::set<std::int32_t> found;
      const std::int64_t groups = (lattice.whole[0] + 7) / 8;
      for (std::int64_t k2 = 0; k2 < lattice.whole[2]; ++k2)
        for (std::int64_t k1 = 0; k1 < lattice.whole[1]; ++k1)
          for (std::int64_t g = 0; g<groups; g += tiling.count[0]> 1 ? 1 : groups) {
            const std::int64_t tile = tiling.number(tiling.of({8 * g, k1, k2}));
            const std::int32_t colour = colours.of(tile);
            found.insert(colour);
            for (const auto& d : reached) tiles[{colour, tiling.count[0] > 1 ? g + d[0] : 0, k1 + d[1], k2 + d[2]}].insert(tile);
          }
      CHECK(std::ranges::all_of(tiles, [](const auto& of_cell) { return of_cell.second.size() == 1; }));
      std::size_t most = 1;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::int64_t reach = axis == 0 ? (cells + 7) / 8 : std::min(cells, lattice.whole[axis] - 1);
        most *=
            static_cast<std::size_t>(std::min(tiling.count[axis], 1 + (2 * reach + tiling.size[axis] - 1) / tiling.size[axis]));
      }
      CHECK(found.size() <= most);
    }
}

TEST_CASE("order of a loop: each index once, after all that it waits for, and a thread comes soon to what waited in its share") {
  // Blocks in a row of which every other one waits for both neighbours.
  constexpr std::size_t n = 101;
  LoopWaits waits_for(n);
  for (std::size_t i = 1; i < n; i += 2) waits_for[i] = {static_cast<std::int32_t>(i - 1), static_cast<std::int32_t>(i + 1)};
  LoopOrder order(std::make_shared<const LoopWaits>(waits_for));
  const auto check = [&](int threads, const std::vector<std::int32_t>& turns) {
    REQUIRE(turns.size() == n);
    std::vector<int> place(n, -1);
    for (std::size_t k = 0; k < n; ++k) place[static_cast<std::size_t>(turns[k])] = static_cast<int>(k);
    CHECK(std::ranges::count(place, -1) == 0);
    const auto share = [&](std::size_t i) { return detail::share_of(i, n, static_cast<std::size_t>(threads)); };
    int farthest = 0, nearest = n;
    for (std::size_t i = 1; i < n; i += 2)
      for (const std::int32_t other : waits_for[i]) {
        const int apart = place[i] - place[static_cast<std::size_t>(other)];
        nearest = std::min(nearest, apart);
        if (share(i - 1) == share(i + 1)) farthest = std::max(farthest, apart);
      }
    CHECK(nearest >= 1);
    if (threads == 1) CHECK(farthest <= 3);
    if (threads == 2) CHECK(farthest <= 12);
  };
  check(1, order.turns());
  for (const int threads : {1, 2, 7, 64}) {
    order.begin(threads);
    std::vector<std::int32_t> turns;   // of threads that take one after the other
    while (order.taken() < n)
      for (int t = 0; t < threads; ++t)
        if (const std::optional<std::size_t> i = order.take(t)) {
          turns.push_back(static_cast<std::int32_t>(*i));
          order.end(*i);
        }
    check(threads, turns);
  }
}

TEST_CASE("order of a loop: each index once, after all that it waits for, late ones after what arrives, on any number of threads") {
  constexpr std::size_t n = 300;
  std::mt19937 random(5);
  LoopWaits waits_for(n);
  std::vector<std::uint8_t> late(n, 0);
  for (std::size_t i = 1; i < n; ++i) {
    std::set<std::int32_t> others;
    for (int k = 0; k < 3; ++k)
      if (random() % 2 == 0) others.insert(static_cast<std::int32_t>(random() % i));
    waits_for[i].assign(others.begin(), others.end());
    late[i] = random() % 10 == 0 || std::ranges::any_of(others, [&](std::int32_t other) { return late[static_cast<std::size_t>(other)] != 0; });
  }
  LoopOrder order(std::make_shared<const LoopWaits>(waits_for), late);
  CHECK(order.early() == static_cast<std::size_t>(std::ranges::count(late, std::uint8_t{0})));
  const int before = thread_count();
  Late arrival;
  for (const int threads : {1, 2, 3, 8, 64}) {
    set_thread_count(threads);
    for (int round = 0; round < 20; ++round) {
      std::vector<std::atomic<int>> ended(n);
      std::atomic<int> too_early = 0;
      if (round % 2 == 1) arrival.start();
      parallel_for(
          order,
          [&](std::size_t i) {
            for (const std::int32_t other : waits_for[i]) too_early += ended[static_cast<std::size_t>(other)] != 1;
            too_early += late[i] != 0 && arrival.pending();
            ++ended[i];
          },
          round % 2 == 1 ? &arrival : nullptr);
      CHECK(too_early == 0);
      CHECK(std::ranges::all_of(ended, [](int times) { return times == 1; }));
      CHECK_FALSE(arrival.pending());
    }
  }
  set_thread_count(before);
}

TEST_CASE("loops begin with the same share of indices on the same thread") {
  for (const std::size_t n : {2, 7, 8, 100})
    for (const int threads : {1, 2, 3, 7, 64}) {
      detail::WorkStealing shares(10, 10 + n, threads, Sharing::help);
      std::vector<int> taken(n, 0);
      // All threads side by side, one index each.
      for (bool any = true; any;) {
        any = false;
        for (int t = 0; t < threads; ++t)
          if (const std::optional<std::size_t> i = shares.take(t, threads)) {
            any = true;
            REQUIRE(*i - 10 < n);
            ++taken[*i - 10];
            // An index of another's share only when nothing of its own is left.
            const std::size_t whose = detail::share_of(*i - 10, n, static_cast<std::size_t>(threads));
            for (std::size_t k = 0; k < n && whose != static_cast<std::size_t>(t); ++k)
              if (detail::share_of(k, n, static_cast<std::size_t>(threads)) == static_cast<std::size_t>(t)) CHECK(taken[k] == 1);
          }
      }
      CHECK(taken == std::vector<int>(n, 1));
      // Fewer threads than were asked for do all of it, even where they do not help each other.
      for (const int team : {1, 2, 3}) {
        detail::WorkStealing kept(0, n, threads, Sharing::keep);
        std::vector<int> done(n, 0);
        for (int t = 0; t < std::min(team, threads); ++t)
          while (const std::optional<std::size_t> i = kept.take(t, std::min(team, threads))) ++done[*i];
        CHECK(done == std::vector<int>(n, 1));
      }
    }
}

TEST_CASE("times of loops: each index once, and how long they take on more threads") {
  CHECK(makespan({{3, 1, 1, 1}, {}}, 2) == 3);
  CHECK(makespan({{1, 1, 1, 3}, {}}, 2) == 4);        // in their order
  CHECK(makespan({{1, 1, 1, 1, 9, 1}, {}}, 2) == 10);   // half of them on each: the other helps with the last, which is behind the long one
  CHECK(makespan({{1, 1, 1, 1, 9, 1}, {}, Sharing::keep}, 2) == 11);
  CHECK(makespan({{1, 2, 3}, {}}, 1) == 6);
  CHECK(makespan({{1, 2, 3}, {}}, 64) == 3);
  CHECK(makespan({}, 4) == 0);
  const auto waiting = [](std::vector<double> seconds, LoopWaits waits_for) {
    return TimedLoop{std::move(seconds), std::make_shared<const LoopWaits>(std::move(waits_for))};
  };
  CHECK(makespan(waiting({3, 1, 2, 1}, {{}, {}, {1}, {0, 2}}), 2) == 4);
  CHECK(makespan(waiting({1, 1, 1}, {{}, {0}, {1}}), 64) == 3);
  LoopTimes times;
  std::vector<int> seen(7, 0);
  parallel_for(seen.size(), [&](std::size_t i) { ++seen[i]; });
  const auto loops = times.take();
  CHECK(seen == std::vector<int>(7, 1));
  REQUIRE(loops.size() == 1);
  CHECK(loops[0].seconds.size() == 7);
  CHECK(loops[0].waits_for == nullptr);
  for (const double seconds : loops[0].seconds) CHECK(seconds >= 0);
  CHECK(times.take().empty());
}

TEST_CASE("quiet blocks: pass k reaches k blocks further than what moves") {
  RestingBlocks quiet(row(10));
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
  RestingBlocks none;
  none.look(2, [](std::size_t) { return false; });
  CHECK(none.awake(0, 1));
  RestingBlocks quiet(row(4));
  quiet.wake();
  for (std::size_t b = 0; b < 4; ++b) CHECK(quiet.awake(b, 1));
}

TEST_CASE("quiet blocks: laws with a history never sleep again") {
  RestingBlocks quiet(row(10), true);
  quiet.look(1, [](std::size_t b) { return b == 5; });
  quiet.look(1, [](std::size_t) { return false; });
  for (std::size_t b = 0; b < 10; ++b) CHECK(quiet.awake(b, 1) == (b >= 4 && b <= 6));
  quiet.stay_awake();
  quiet.look(1, [](std::size_t) { return false; });
  CHECK(quiet.awake(0, 1));
}

TEST_CASE("quiet blocks: where all have moved, none is looked at any more") {
  RestingBlocks quiet(row(10));
  std::atomic<int> looks = 0;
  const auto moves_to = [&](std::size_t last) {
    quiet.look(1, [&, last](std::size_t b) {
      ++looks;
      return b <= last;
    });
  };
  moves_to(8);
  CHECK(quiet.awake(9, 1));   // within reach, but at rest
  moves_to(2);
  CHECK_FALSE(quiet.awake(9, 1));
  moves_to(9);
  CHECK(looks == 30);
  moves_to(0);
  CHECK(looks == 30);
  for (std::size_t b = 0; b < 10; ++b) CHECK(quiet.awake(b, 1));
  CHECK(quiet.counts().blocks == 40);
  CHECK(quiet.counts().quiet == 6);
}

namespace {

/// Adds 1 to values.
class Raise final : public PointMotion {
 public:
  explicit Raise(std::vector<int>& values) : PointMotion(values.size()), values_(values) {}
  void start() { expect(); }

 private:
  void move(std::size_t begin, std::size_t end) noexcept override {
    for (std::size_t p = begin; p < end; ++p) ++values_[p];
  }
  std::vector<int>& values_;
};

}  // namespace

TEST_CASE("motion: what a loop needs has moved when it goes on, and everything moves once") {
  const int threads = thread_count();
  std::mt19937 random(7);
  for (const std::size_t points : {std::size_t{1}, std::size_t{128}, std::size_t{1000}, std::size_t{20001}})
    for (const int n : {1, 2, 3, 16}) {
      set_thread_count(n);
      std::vector<int> values(points, 0);
      Raise raise(values);
      CHECK_FALSE(raise.pending());
      const std::size_t pieces = (points + PointMotion::piece_points - 1) / PointMotion::piece_points;
      std::vector<std::vector<std::int32_t>> needed(200);
      for (std::vector<std::int32_t>& of_index : needed)
        for (std::size_t i = 0; i < pieces; ++i)
          if (random() % 16 == 0) of_index.push_back(static_cast<std::int32_t>(i));
      for (int round = 1; round <= 5; ++round) {
        raise.start();
        CHECK(raise.pending());
        std::atomic<int> early{0};
        parallel_for(needed.size(), [&](std::size_t k) {
          raise.need(needed[k]);
          for (const std::int32_t i : needed[k])
            for (std::size_t p = static_cast<std::size_t>(i) * PointMotion::piece_points; p < std::min(points, static_cast<std::size_t>(i + 1) * PointMotion::piece_points); ++p)
              if (values[p] != round) ++early;
        });
        raise.finish();
        raise.finish();
        CHECK(early == 0);
        CHECK_FALSE(raise.pending());
        CHECK(std::ranges::count(values, round) == static_cast<std::ptrdiff_t>(points));
      }
    }
  set_thread_count(threads);
}
