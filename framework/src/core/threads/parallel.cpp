#include "perikit/core/parallel.hpp"

#include <omp.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <queue>
#include <utility>
#include <vector>

#include "core/threads/loop_order.hpp"
#include "core/threads/loop_times.hpp"
#include "core/threads/thread_team.hpp"
#include "core/threads/work_stealing.hpp"
#include "perikit/core/simd.hpp"

namespace perikit {

namespace {

int threads = counts_operations ? 1 : std::max(1, omp_get_max_threads());
std::optional<std::vector<TimedLoop>> loop_times;

void run_timed(std::size_t n, void* context, void (*body)(void*, std::size_t), Sharing sharing, LoopOrder* order = nullptr) {
  using Clock = std::chrono::steady_clock;
  TimedLoop loop{std::vector<double>(n), order ? order->waits_for() : nullptr, sharing};
  auto before = Clock::now();
  for (std::size_t k = 0; k < n; ++k) {
    const std::size_t i = order ? static_cast<std::size_t>(order->turns()[k]) : k;
    body(context, i);
    const auto now = Clock::now();
    loop.seconds[i] = std::chrono::duration<double>(now - before).count();
    before = now;
  }
  loop_times->push_back(std::move(loop));
}

/// Threads that take indices as soon as they are free. take(thread): the next one; end(index).
template <class Take, class EndOf>
double makespan(const std::vector<double>& seconds, int threads, const Take& take, const EndOf& end) {
  struct End {
    double at;
    int thread;
    std::size_t index;
    bool operator>(const End& other) const noexcept { return std::pair(at, thread) > std::pair(other.at, other.thread); }
  };
  std::priority_queue<End, std::vector<End>, std::greater<>> running;
  std::vector<std::uint8_t> busy(static_cast<std::size_t>(threads), 0);
  for (double now = 0;;) {
    for (int thread = 0; thread < threads; ++thread)
      if (auto& works = busy[static_cast<std::size_t>(thread)]; !works)
        if (const std::optional<std::size_t> i = take(thread)) {
          works = 1;
          running.push({now + seconds[*i], thread, *i});
        }
    if (running.empty()) return now;
    for (now = running.top().at; !running.empty() && running.top().at == now; running.pop()) {
      end(running.top().index);
      busy[static_cast<std::size_t>(running.top().thread)] = 0;
    }
  }
}

}  // namespace

int thread_count() noexcept { return threads; }
void set_thread_count(int n) noexcept { threads = counts_operations ? 1 : std::max(1, n); }
int thread_index() noexcept { return detail::team_index(); }

LoopTimes::LoopTimes() { loop_times.emplace(); }
LoopTimes::~LoopTimes() { loop_times.reset(); }
std::vector<TimedLoop> LoopTimes::take() { return std::exchange(*loop_times, {}); }

double makespan(const TimedLoop& loop, int threads) {
  if (loop.waits_for) {
    LoopOrder order(loop.waits_for);
    order.begin(threads);
    return makespan(loop.seconds, threads, [&](int thread) { return order.take(thread); }, [&](std::size_t i) { order.end(i); });
  }
  detail::WorkStealing shares(0, loop.seconds.size(), threads, loop.sharing);
  return makespan(loop.seconds, threads, [&](int thread) { return shares.take(thread, threads); }, [](std::size_t) {});
}

namespace detail {

void parallel_for(std::size_t n, LateIndices late, Sharing sharing, void* context, void (*body)(void*, std::size_t)) {
  const bool expects = late.any();
  if (loop_times) [[unlikely]] {
    if (expects) late.arrival->finish();
    return run_timed(n, context, body, sharing);
  }
  if (threads == 1 || n < 2) {
    for (std::size_t i = 0; i < n; ++i) {
      if (expects && i >= late.first) late.arrival->finish();
      body(context, i);
      if (expects) late.arrival->look();
    }
    if (expects) late.arrival->finish();
    return;
  }
  // The thread that runs the loop, which alone may fetch what arrives, looks for it between indices.
  const std::size_t first = expects ? std::min(late.first, n) : n;
  WorkStealing early(0, first, threads, sharing), others(first, n, threads, sharing);
  run_team(threads, [&](int thread, int team) {
    while (const auto i = early.take(thread, team)) {
      body(context, *i);
      if (expects && thread == 0) late.arrival->look();
    }
    if (!expects) return;
    if (thread == 0) late.arrival->finish();
    for (Patience patience; late.arrival->pending();) patience.wait();
    while (const auto i = others.take(thread, team)) body(context, *i);
  });
}

void parallel_for(LoopOrder& order, Arrival* arrival, void* context, void (*body)(void*, std::size_t)) {
  const std::size_t n = order.size();
  const bool expects = arrival && arrival->pending();
  if (loop_times) [[unlikely]] {
    if (expects) arrival->finish();
    return run_timed(n, context, body, Sharing::help, &order);
  }
  if (threads == 1 || n < 2) {
    const std::vector<std::int32_t>& turns = order.turns();
    auto in_turn = [&](std::size_t k) { body(context, static_cast<std::size_t>(turns[k])); };
    return perikit::parallel_for(n, in_turn, {order.early(), arrival});
  }
  order.begin(threads);
  run_team(threads, [&](int thread, int) {
    for (Patience patience; order.taken() < n;) {
      const bool there = !expects || !arrival->pending();
      if (const auto i = order.take(thread, there)) {
        body(context, *i);
        order.end(*i);
        if (expects && thread == 0) arrival->look();
        patience = {};
      } else if (!there && thread == 0 && order.taken() >= order.early()) {
        arrival->finish();
      } else {
        patience.wait();
      }
    }
    if (expects && thread == 0) arrival->finish();
  });
}

}  // namespace detail

}  // namespace perikit
