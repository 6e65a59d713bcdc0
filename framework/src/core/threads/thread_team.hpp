#pragma once
/// The threads of one loop: GCC's OpenMP, or, for the thread sanitizer, std::thread. The sanitizer does not see the barriers of the OpenMP runtime, which
/// is built without it, and would call every value that one loop writes and a later one reads a race.

#include <omp.h>

#include <cstddef>

#if defined(__SANITIZE_THREAD__)
#include <thread>
#include <vector>
#endif

namespace perikit::detail {

#if defined(__SANITIZE_THREAD__)

inline thread_local int own_team_index = 0;
inline int team_index() noexcept { return own_team_index; }

/// work(thread, threads) on each of so many threads; the first is the one that calls.
template <class Work>
void run_team(int threads, const Work& work) {
  std::vector<std::thread> others;
  for (int thread = 1; thread < threads; ++thread)
    others.emplace_back([&work, thread, threads] {
      own_team_index = thread;
      work(thread, threads);
    });
  work(0, threads);
  for (std::thread& other : others) other.join();
}

#else

inline int team_index() noexcept { return omp_get_thread_num(); }

/// work(thread, team) on each of `team` threads: as many as are asked for, or fewer, where the runtime has a limit or the caller is one of a team
/// (OMP_THREAD_LIMIT, loops within loops). The first is the one that calls.
template <class Work>
void run_team(int threads, const Work& work) {
#pragma omp parallel num_threads(threads)
  work(omp_get_thread_num(), omp_get_num_threads());
}

#endif

}  // namespace perikit::detail
