#pragma once
/// How long each block of each parallel loop takes, and what that makes on more threads than this machine has.

#include <memory>
#include <vector>

#include "perikit/core/parallel.hpp"

namespace perikit {

/// A loop: the seconds of each index, and which indices it waits for (null: none wait).
struct TimedLoop {
  std::vector<double> seconds;
  std::shared_ptr<const LoopWaits> waits_for;
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

/// Seconds until the last thread is done when threads take indices in their order (`loop_turns` where some wait), each the next
/// one as soon as it is free, and wait with it for what it waits for, as parallel_for does. Starting and ending the loop costs
/// nothing here.
double makespan(const TimedLoop& loop, int threads);

}  // namespace perikit
