#include "output/machine_limits.hpp"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "perikit/core/parallel.hpp"
#include "perikit/core/simd.hpp"

namespace perikit {

namespace {

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Largest amount per second of `pass` over repetitions for the given time; the first one only warms up.
template <class Pass>
double best_rate(double seconds, double amount, Pass&& pass) {
  pass();
  double best = 0;
  const double end = now() + seconds;
  do {
    const double start = now();
    pass();
    best = std::max(best, amount / (now() - start));
  } while (now() < end);
  return best;
}

/// body(slice) for every slice, each on a thread of its own, or one after the other in the calling thread.
template <class Body>
void for_slices(bool all, std::size_t slices, Body&& body) {
  if (all)
    parallel_for(slices, body);
  else
    for (std::size_t slice = 0; slice < slices; ++slice) body(slice);
}

/// Makes the compiler believe that the value is needed.
void keep(double value) {
  asm volatile("" : : "m"(value) : "memory");
}

using Array = std::unique_ptr<double[]>;  // not a vector: pages belong to the thread that touches them first

void measure_triad(MachineLimits& limits, double seconds) {
  constexpr std::size_t n = std::size_t{1} << 23;
  const std::size_t slices = static_cast<std::size_t>(limits.threads);
  const Array a(new double[n]), b(new double[n]), c(new double[n]);
  const auto bounds = [&](std::size_t slice) { return std::pair{slice * n / slices, (slice + 1) * n / slices}; };
  parallel_for(slices, [&](std::size_t slice) {
    const auto [first, last] = bounds(slice);
    for (std::size_t i = first; i < last; ++i) a[i] = 0, b[i] = 1, c[i] = 2;
  });
  const auto rate = [&](bool all) {
    const double bytes = 24.0 * n;
    return 1e-9 * best_rate(seconds / 2, bytes, [&] {
             for_slices(all, slices, [&](std::size_t slice) {
               const auto [first, last] = bounds(slice);
               double* const out = a.get();
               const double *const left = b.get(), *const right = c.get();
#pragma GCC ivdep
               for (std::size_t i = first; i < last; ++i) out[i] = left[i] + 0.5 * right[i];
               keep(out[first]);
             });
           });
  };
  limits.triad_one = rate(false);
  limits.triad_all = rate(true);
}

void measure_multiply_add(MachineLimits& limits, double seconds) {
#if defined(__aarch64__)
  constexpr int chains = 16;            // latency (4) times issue width (up to 4)
  constexpr bool adds_in_place = true;  // the sum overwrites the term: any other one would have to be copied first
#else
  constexpr int chains = 12;  // more than latency (4) times issue width (2)
  constexpr bool adds_in_place = false;
#endif
  constexpr int rounds = 100000;
  auto chain = [](std::size_t) {
    Pack x[chains];
    for (int k = 0; k < chains; ++k) x[k] = Pack(1.0 + k);
    Pack factor(adds_in_place ? -0.001 : 0.999), term(0.001);
    asm volatile("" : "+m"(factor.v), "+m"(term.v));
    for (int round = 0; round < rounds; ++round)
      for (int k = 0; k < chains; ++k) x[k] = x[k] * factor + (adds_in_place ? x[k] : term);
    Pack total;
    for (int k = 0; k < chains; ++k) total += x[k];
    keep(sum(total));
  };
  constexpr double operations = 2.0 * pack_width * chains * rounds;
  const std::size_t tasks = 4 * static_cast<std::size_t>(limits.threads);  // a pass is long against starting the threads
  const auto rate = [&](bool all) {
    return 1e-9 * best_rate(seconds / 2, operations * static_cast<double>(tasks), [&] { for_slices(all, tasks, chain); });
  };
  limits.multiply_add_one = rate(false);
  limits.multiply_add_all = rate(true);
}

void measure_gather(MachineLimits& limits, double seconds) {
  constexpr std::size_t rows = std::size_t{1} << 21, gathers = std::size_t{1} << 20;
  const std::size_t slices = static_cast<std::size_t>(limits.threads);
  const std::vector<double> table(4 * rows, 1.0);
  std::vector<std::uint32_t> index(gathers);
  std::uint64_t state = 1;
  for (std::uint32_t& i : index) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    i = static_cast<std::uint32_t>(state >> 43);  // 21 bits
  }
  const auto rate = [&](bool all) {
    return 1e-9 * best_rate(seconds / 2, 32.0 * gathers, [&] {
             for_slices(all, slices, [&](std::size_t slice) {
               double x = 0, y = 0, z = 0, w = 0;
               for (std::size_t k = slice * gathers / slices; k < (slice + 1) * gathers / slices; ++k) {
                 const double* row = table.data() + 4 * static_cast<std::size_t>(index[k]);
                 x += row[0];
                 y += row[1];
                 z += row[2];
                 w += row[3];
               }
               keep(x + y + z + w);
             });
           });
  };
  limits.gather_one = rate(false);
  limits.gather_all = rate(true);
}

}  // namespace

MachineLimits measure_machine_limits(double seconds) {
  MachineLimits limits;
  limits.threads = thread_count();
  measure_triad(limits, seconds);
  measure_multiply_add(limits, seconds);
  measure_gather(limits, seconds);
  return limits;
}

}  // namespace perikit
