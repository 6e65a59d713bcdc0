#include "perikit/core/parallel.hpp"

#include <omp.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <queue>
#include <thread>
#include <utility>
#include <vector>

#include "core/thread_team.hpp"
#include "perikit/core/loop_times.hpp"
#include "perikit/core/simd.hpp"

namespace perikit {

namespace {
int threads = counts_operations ? 1 : std::max(1, omp_get_max_threads());
std::optional<std::vector<TimedLoop>> loop_times;

void run_timed(std::size_t n, void* context, void (*body)(void*, std::size_t), LoopOrder* order = nullptr) {
  using Clock = std::chrono::steady_clock;
  TimedLoop loop{std::vector<double>(n), {}};
  if (order) order->begin(1);
  auto before = Clock::now();
  for (std::size_t k = 0; k < n; ++k) {
    const std::size_t i = order ? order->turn(k) : k;
    body(context, i);
    const auto now = Clock::now();
    loop.seconds[i] = std::chrono::duration<double>(now - before).count();
    before = now;
  }
  if (order) loop.waits_for = order->waits_for();
  loop_times->push_back(std::move(loop));
}
}  // namespace

int thread_count() noexcept { return threads; }
void set_thread_count(int n) noexcept { threads = counts_operations ? 1 : std::max(1, n); }
int thread_index() noexcept { return detail::team_index(); }

LoopTimes::LoopTimes() { loop_times.emplace(); }
LoopTimes::~LoopTimes() { loop_times.reset(); }
std::vector<TimedLoop> LoopTimes::take() { return std::exchange(*loop_times, {}); }

double makespan(const TimedLoop& loop, int threads) {
  std::priority_queue<double, std::vector<double>, std::greater<>> free_at(std::greater<>(), std::vector<double>(static_cast<std::size_t>(threads), 0.0));
  std::vector<double> ends(loop.seconds.size());
  const auto run = [&](std::size_t i, std::span<const std::int32_t> waits_for) {
    double begin = free_at.top();
    for (const std::int32_t other : waits_for) begin = std::max(begin, ends[static_cast<std::size_t>(other)]);
    free_at.pop();
    free_at.push(ends[i] = begin + loop.seconds[i]);
  };
  if (const LoopWaits* const waits = loop.waits_for.get())
    for (const std::int32_t i : loop_turns(*waits, threads))
      run(static_cast<std::size_t>(i), (*waits)[static_cast<std::size_t>(i)]);
  else
    for (std::size_t i = 0; i < ends.size(); ++i) run(i, {});
  return ends.empty() ? 0 : *std::ranges::max_element(ends);
}

/// As if all took equally long: again and again the lowest ones that may begin, then what waited for them. As many at a time as
/// leave each of several threads several to do meanwhile.
std::vector<std::int32_t> loop_turns(const LoopWaits& waits_for, int threads) {
  const std::size_t n = waits_for.size(), together = static_cast<std::size_t>(threads) * static_cast<std::size_t>(threads);
  std::vector<std::size_t> awaited(n);
  std::vector<std::vector<std::int32_t>> followers(n);
  std::priority_queue<std::int32_t, std::vector<std::int32_t>, std::greater<>> ready;
  for (std::size_t i = 0; i < n; ++i) {
    awaited[i] = waits_for[i].size();
    if (awaited[i] == 0) ready.push(static_cast<std::int32_t>(i));
    for (const std::int32_t other : waits_for[i])
      followers[static_cast<std::size_t>(other)].push_back(static_cast<std::int32_t>(i));
  }
  std::vector<std::int32_t> turns;
  while (!ready.empty()) {
    const std::size_t begin = turns.size();
    for (; turns.size() < begin + together && !ready.empty(); ready.pop()) turns.push_back(ready.top());
    for (std::size_t k = begin; k < turns.size(); ++k)
      for (const std::int32_t follower : followers[static_cast<std::size_t>(turns[k])])
        if (--awaited[static_cast<std::size_t>(follower)] == 0) ready.push(follower);
  }
  return turns;
}

LoopOrder::LoopOrder(LoopWaits waits_for, std::vector<std::uint8_t> late)
    : waits_for_(std::make_shared<const LoopWaits>(std::move(waits_for))),
      late_(std::move(late)),
      early_(size() - static_cast<std::size_t>(std::ranges::count(late_, std::uint8_t{1}))),
      ended_(std::make_unique<std::atomic<std::uint32_t>[]>(size())) {}

void LoopOrder::begin(int threads) {
  ++round_;
  if (threads_ == threads) return;
  threads_ = threads;
  turns_ = loop_turns(*waits_for_, threads);
  if (!late_.empty())
    std::ranges::stable_partition(turns_, [&](std::int32_t i) { return late_[static_cast<std::size_t>(i)] == 0; });
}

namespace {

/// Spins until `ready` says so.
template <class Ready>
void await(const Ready& ready) noexcept {
  constexpr int patience = 200;  // then there may be more threads than cores
  for (int spins = 0; !ready(); ++spins)
    if (spins > patience) std::this_thread::yield();
}

/// A body that waits for what its late indices read. The thread that runs the loop, which alone may fetch it, looks for it
/// between indices.
struct Expecting {
  LateIndices late;
  void* context;
  void (*body)(void*, std::size_t);

  static void call(void* of, std::size_t i) {
    const auto& [late, context, body] = *static_cast<Expecting*>(of);
    const bool fetches = detail::team_index() == 0;
    if (i >= late.first) {
      if (fetches)
        late.arrival->finish();
      else
        await([&] { return !late.arrival->pending(); });
    }
    body(context, i);
    if (fetches) late.arrival->look();
  }
};

void run_alone(std::size_t n, void* context, void (*body)(void*, std::size_t)) {
  for (std::size_t i = 0; i < n; ++i) body(context, i);
}

}  // namespace

void LoopOrder::wait(std::size_t i) const noexcept {
  for (const std::int32_t other : (*waits_for_)[i])
    await([&] { return ended_[static_cast<std::size_t>(other)].load(std::memory_order_acquire) == round_; });
}

namespace detail {
void parallel_for(std::size_t n, LateIndices late, void* context, void (*body)(void*, std::size_t)) {
  if (loop_times) [[unlikely]] {
    if (late.any()) late.arrival->finish();
    return run_timed(n, context, body);
  }
  const bool alone = threads == 1 || n < 2;
  if (!late.any()) return alone ? run_alone(n, context, body) : team_for(threads, n, context, body, nullptr);
  Expecting expecting{late, context, body};
  if (!alone) return team_for(threads, n, &expecting, Expecting::call, late.arrival);
  run_alone(n, &expecting, Expecting::call);
  late.arrival->finish();
}

/// A turn comes after those of all that it waits for, so that the first of those that have not ended waits for nothing but what
/// arrives.
void parallel_for(LoopOrder& order, Arrival* arrival, void* context, void (*body)(void*, std::size_t)) {
  const std::size_t n = order.size();
  const LateIndices late{order.early(), arrival};
  if (loop_times) [[unlikely]] {
    if (late.any()) arrival->finish();
    return run_timed(n, context, body, &order);
  }
  struct Ordered {
    LoopOrder& order;
    void* context;
    void (*body)(void*, std::size_t);
  } ordered{order, context, body};
  order.begin(threads);
  const auto alone = [](void* of, std::size_t k) {
    const auto& [order, context, body] = *static_cast<Ordered*>(of);
    body(context, order.turn(k));
  };
  const auto waiting = [](void* of, std::size_t k) {
    const auto& [order, context, body] = *static_cast<Ordered*>(of);
    const std::size_t i = order.turn(k);
    order.wait(i);
    body(context, i);
    order.end(i);
  };
  threads == 1 ? parallel_for(n, late, &ordered, alone) : parallel_for(n, late, &ordered, waiting);
}
}  // namespace detail

}  // namespace perikit
