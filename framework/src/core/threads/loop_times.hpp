#pragma once
/// How long each block of each parallel loop takes, and what that makes on more threads than this machine has.

#include <cstdint>
#include <memory>
#include <vector>

#include "perikit/core/parallel.hpp"

namespace perikit {

/// By index of a loop: those that it waits for, and never, by way of others, itself.
using LoopWaits = std::vector<std::vector<std::int32_t>>;

/// A loop: the seconds of each index, which indices it waits for (null: none wait), and whether threads help each other.
struct TimedLoop {
  std::vector<double> seconds;
  std::shared_ptr<const LoopWaits> waits_for;
  Sharing sharing = Sharing::help;
};

/// While one of these lives, loops run on one thread and are kept. One at a time.
class LoopTimes {
 public:
  LoopTimes();
  ~LoopTimes();
  LoopTimes(const LoopTimes&) = delete;
  LoopTimes& operator=(const LoopTimes&) = delete;

  /// The loops since the last call.
  std::vector<TimedLoop> take();
};

/// Seconds until the last thread is done when threads take indices as those of parallel_for do, each the next one as soon as it is free and one may
/// begin. Starting and ending the loop, and taking an index, cost nothing here.
double makespan(const TimedLoop& loop, int threads);

}  // namespace perikit
