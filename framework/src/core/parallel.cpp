#include "perikit/core/parallel.hpp"

#include <omp.h>

#include <algorithm>

#include "core/thread_team.hpp"
#include "perikit/core/simd.hpp"

namespace perikit {

namespace {
int threads = counts_operations ? 1 : std::max(1, omp_get_max_threads());
}

int thread_count() noexcept { return threads; }
void set_thread_count(int n) noexcept { threads = counts_operations ? 1 : std::max(1, n); }
int thread_index() noexcept { return detail::team_index(); }

namespace detail {
void parallel_for(std::size_t n, void* context, void (*body)(void*, std::size_t)) {
  if (threads == 1 || n < 2) {
    for (std::size_t i = 0; i < n; ++i) body(context, i);
    return;
  }
  team_for(threads, n, context, body);
}
}  // namespace detail

}  // namespace perikit
