#pragma once
/// How long each block of each parallel loop takes, and what that makes on more threads than this machine has.

#include <vector>

namespace perikit {

/// While one of these lives, loops run on one thread and the seconds of each of their indices are kept, loop by loop. One at a time.
class LoopTimes {
 public:
  LoopTimes();
  ~LoopTimes();
  LoopTimes(const LoopTimes&) = delete;
  LoopTimes& operator=(const LoopTimes&) = delete;

  /// The loops since the last call.
  std::vector<std::vector<double>> take();
};

/// Seconds until the last thread is done when threads take blocks in their order, each the next one as soon as it is free, as
/// parallel_for hands them out. Starting and ending the loop costs nothing here.
double makespan(const std::vector<double>& blocks, int threads);

}  // namespace perikit
