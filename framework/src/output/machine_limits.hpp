#pragma once
/// What this machine can do at best, measured: the scale against which the speed of the kernels is read.

namespace perikit {

struct MachineLimits {
  int threads = 1;       ///< of the `_all` figures: thread_count()
  double triad_one = 0;  ///< a = b + s c on arrays far beyond the caches, one thread [GB/s], 24 bytes an entry
  double triad_all = 0;  ///< likewise, all threads [GB/s]
  double multiply_add_one =
      0;  ///< independent fused multiply-adds of Packs in registers, one thread [GFLOP/s], two operations each
  double multiply_add_all = 0;  ///< likewise, all threads [GFLOP/s]
  double gather_one = 0;        ///< random rows of 4 doubles from a table of 64 MB, one thread [GB/s], 32 bytes a row
  double gather_all = 0;        ///< likewise, all threads [GB/s]
};

/// Measures for about `seconds` in each of the three kinds, half of it on one thread; each figure is the best of the repetitions.
/// Needs about 200 MB. Throws std::bad_alloc where they are not to be had.
MachineLimits measure_machine_limits(double seconds = 0.3);

}  // namespace perikit
