#include "perikit/core/parallel.hpp"

#include <algorithm>
#include <atomic>
#include <thread>
#include <vector>

#ifdef PERIKIT_PLAIN_THREADS
/// For the thread sanitizer alone, which does not see the barriers of OpenMP's runtime: threads started anew for every loop.
namespace perikit {
namespace {
int threads = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
thread_local int index_of_this = 0;
}  // namespace

int thread_index() noexcept { return index_of_this; }

namespace detail {
static void share_out(std::size_t n, void* context, void (*body)(void*, std::size_t)) {
  std::atomic<std::size_t> next{0};
  const auto work = [&](int index) {
    index_of_this = index;
    for (std::size_t i = next++; i < n; i = next++) body(context, i);
    index_of_this = 0;
  };
  std::vector<std::thread> others;
  for (int k = 1; k < threads; ++k) others.emplace_back(work, k);
  work(0);
  for (std::thread& other : others) other.join();
}
}  // namespace detail
}  // namespace perikit
#else
#include <omp.h>

namespace perikit {
namespace {
int threads = std::max(1, omp_get_max_threads());
}

int thread_index() noexcept { return omp_get_thread_num(); }

namespace detail {
static void share_out(std::size_t n, void* context, void (*body)(void*, std::size_t)) {
#pragma omp parallel for schedule(dynamic, 1) num_threads(threads)
  for (std::size_t i = 0; i < n; ++i) body(context, i);
}
}  // namespace detail
}  // namespace perikit
#endif

namespace perikit {

int thread_count() noexcept { return threads; }
void set_thread_count(int n) noexcept { threads = std::max(1, n); }

namespace detail {
void parallel_for(std::size_t n, void* context, void (*body)(void*, std::size_t)) {
  if (threads == 1 || n < 2) {
    for (std::size_t i = 0; i < n; ++i) body(context, i);
    return;
  }
  share_out(n, context, body);
}
}  // namespace detail

double ordered_sum(std::size_t blocks, const std::function<double(std::size_t)>& term) {
  std::vector<double> parts(blocks);
  parallel_for(blocks, [&](std::size_t b) { parts[b] = term(b); });
  double total = 0;
  for (const double part : parts) total += part;
  return total;
}

}  // namespace perikit
