#include "perikit/core/parallel.hpp"

#include <omp.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <queue>
#include <utility>
#include <vector>

#include "core/thread_team.hpp"
#include "perikit/core/loop_times.hpp"
#include "perikit/core/simd.hpp"

namespace perikit {

namespace {
int threads = counts_operations ? 1 : std::max(1, omp_get_max_threads());
std::optional<std::vector<std::vector<double>>> loop_times;

void run_timed(std::size_t n, void* context, void (*body)(void*, std::size_t)) {
  using Clock = std::chrono::steady_clock;
  std::vector<double> seconds(n);
  auto before = Clock::now();
  for (std::size_t i = 0; i < n; ++i) {
    body(context, i);
    const auto now = Clock::now();
    seconds[i] = std::chrono::duration<double>(now - before).count();
    before = now;
  }
  loop_times->push_back(std::move(seconds));
}
}  // namespace

int thread_count() noexcept { return threads; }
void set_thread_count(int n) noexcept { threads = counts_operations ? 1 : std::max(1, n); }
int thread_index() noexcept { return detail::team_index(); }

LoopTimes::LoopTimes() { loop_times.emplace(); }
LoopTimes::~LoopTimes() { loop_times.reset(); }
std::vector<std::vector<double>> LoopTimes::take() { return std::exchange(*loop_times, {}); }

double makespan(const std::vector<double>& blocks, int threads) {
  std::priority_queue<double, std::vector<double>, std::greater<>> free_at(std::greater<>(), std::vector<double>(static_cast<std::size_t>(threads), 0.0));
  double last = 0;
  for (const double seconds : blocks) {
    const double end = free_at.top() + seconds;
    free_at.pop();
    free_at.push(end);
    last = std::max(last, end);
  }
  return last;
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
}  // namespace detail

}  // namespace perikit
