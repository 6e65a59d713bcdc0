#include "output/machine_limits.hpp"

#include <doctest/doctest.h>

#include <initializer_list>

#include "perikit/core/parallel.hpp"

using namespace perikit;

TEST_CASE("machine limits are of a plausible size, in the stated units") {
  const MachineLimits limits = measure_machine_limits(0.02);
  MESSAGE("triad " << limits.triad_one << " and " << limits.triad_all << " GB/s, multiply-add " << limits.multiply_add_one
                   << " and " << limits.multiply_add_all << " GFLOP/s, gather " << limits.gather_one << " and "
                   << limits.gather_all << " GB/s on 1 and " << limits.threads << " threads");
  CHECK(limits.threads == thread_count());
  // wide enough for any machine and a busy one; a slip of units or a loop that the compiler removed lies outside
  for (const double rate : {limits.triad_one, limits.triad_all}) CHECK((rate > 0.2 && rate < 5000));
  for (const double rate : {limits.multiply_add_one, limits.multiply_add_all}) CHECK((rate > 0.2 && rate < 2e4));
  for (const double rate : {limits.gather_one, limits.gather_all}) CHECK((rate > 0.02 && rate < 2000));
  CHECK(limits.multiply_add_one < 400);
  CHECK(limits.triad_one < 500);
}
