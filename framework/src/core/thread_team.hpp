#pragma once
/// The threads of one loop, each of which takes indices in ascending order: GCC's OpenMP, or, for the thread sanitizer, std::thread. The sanitizer does not see the barriers of the OpenMP
/// runtime, which is built without it, and would call every value that one loop writes and a later one reads a race.

#include <omp.h>

#include <cstddef>

#include "perikit/core/parallel.hpp"

#if defined(__SANITIZE_THREAD__)
#include <thread>
#include <vector>
#endif

namespace perikit::detail {

#if defined(__SANITIZE_THREAD__)

inline thread_local int own_team_index = 0;
inline int team_index() noexcept { return own_team_index; }

/// Index i on thread i mod `threads`: neighbouring blocks always meet on different threads, whatever the machine is doing. The
/// first thread, when it finds no more to do, waits for `arrival`, for which others may be waiting.
inline void team_for(int threads, std::size_t n, void* context, void (*body)(void*, std::size_t), Arrival* arrival) {
  const auto share = [&](int thread) {
    own_team_index = thread;
    for (std::size_t i = static_cast<std::size_t>(thread); i < n; i += static_cast<std::size_t>(threads)) body(context, i);
    if (arrival && thread == 0) arrival->finish();
  };
  std::vector<std::thread> others;
  for (int thread = 1; thread < threads; ++thread) others.emplace_back(share, thread);
  share(0);
  for (std::thread& other : others) other.join();
}

#else

inline int team_index() noexcept { return omp_get_thread_num(); }

inline void team_for(int threads, std::size_t n, void* context, void (*body)(void*, std::size_t), Arrival* arrival) {
#pragma omp parallel num_threads(threads)
  {
#pragma omp for schedule(monotonic : dynamic, 1) nowait
    for (std::size_t i = 0; i < n; ++i) body(context, i);
    if (arrival && omp_get_thread_num() == 0) arrival->finish();
  }
}

#endif

}  // namespace perikit::detail
