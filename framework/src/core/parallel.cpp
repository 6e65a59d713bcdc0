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

void run_timed(std::size_t n, void* context, void (*body)(void*, std::size_t), const LoopOrder* order = nullptr) {
  using Clock = std::chrono::steady_clock;
  TimedLoop loop{std::vector<double>(n), {}};
  auto before = Clock::now();
  for (std::size_t i = 0; i < n; ++i) {
    body(context, i);
    const auto now = Clock::now();
    loop.seconds[i] = std::chrono::duration<double>(now - before).count();
    before = now;
  }
  for (std::size_t i = 0; order && i < n; ++i) loop.waits_for.emplace_back(order->waits_for(i).begin(), order->waits_for(i).end());
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
  std::vector<double> ends;
  for (std::size_t i = 0; i < loop.seconds.size(); ++i) {
    double begin = free_at.top();
    for (std::size_t k = 0; !loop.waits_for.empty() && k < loop.waits_for[i].size(); ++k)
      begin = std::max(begin, ends[static_cast<std::size_t>(loop.waits_for[i][k])]);
    free_at.pop();
    free_at.push(ends.emplace_back(begin + loop.seconds[i]));
  }
  return ends.empty() ? 0 : *std::ranges::max_element(ends);
}

LoopOrder::LoopOrder(const std::vector<std::vector<std::int32_t>>& waits_for)
    : ended_(std::make_unique<std::atomic<std::uint32_t>[]>(waits_for.size())) {
  for (const std::vector<std::int32_t>& of : waits_for) {
    waits_for_.insert(waits_for_.end(), of.begin(), of.end());
    first_.push_back(static_cast<std::int64_t>(waits_for_.size()));
  }
}

void LoopOrder::wait(std::size_t i) const noexcept {
  constexpr int patience = 200;   // then there may be more threads than cores
  for (const std::int32_t other : waits_for(i))
    for (int spins = 0; ended_[static_cast<std::size_t>(other)].load(std::memory_order_acquire) != round_; ++spins)
      if (spins > patience) std::this_thread::yield();
}

namespace detail {
void parallel_for(std::size_t n, void* context, void (*body)(void*, std::size_t)) {
  if (loop_times) [[unlikely]]
    return run_timed(n, context, body);
  if (threads == 1 || n < 2) {
    for (std::size_t i = 0; i < n; ++i) body(context, i);
    return;
  }
  team_for(threads, n, context, body);
}

/// Indices are handed out in ascending order, so that the lowest of those that have not ended waits for nothing.
void parallel_for(LoopOrder& order, void* context, void (*body)(void*, std::size_t)) {
  const std::size_t n = order.size();
  if (loop_times) [[unlikely]]
    return run_timed(n, context, body, &order);
  if (threads == 1 || n < 2) return parallel_for(n, context, body);
  struct Ordered {
    LoopOrder& order;
    void* context;
    void (*body)(void*, std::size_t);
  } ordered{order, context, body};
  order.begin();
  team_for(threads, n, &ordered, [](void* of, std::size_t i) {
    const auto& [order, context, body] = *static_cast<Ordered*>(of);
    order.wait(i);
    body(context, i);
    order.end(i);
  });
}
}  // namespace detail

}  // namespace perikit
