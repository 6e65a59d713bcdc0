// Does the thread sanitizer see what parallel_for does? `race clean`: values that one loop writes and the next one reads, from other threads:
// must be silent. `race seen`: neighbouring blocks add to one value: must be reported.
#include <cstdio>
#include <string_view>
#include <vector>

#include "perikit/core/parallel.hpp"

int main(int count, char** arguments) {
  if (count != 2) return 2;
  perikit::set_thread_count(3);
  constexpr std::size_t blocks = 64;
  std::vector<double> a(blocks, 1.0), b(blocks, 0.0);
  double sum = 0;
  for (int step = 0; step < 20; ++step) {
    perikit::parallel_for(blocks, [&](std::size_t i) { b[i] = a[(i + 1) % blocks] + perikit::thread_index(); });
    perikit::parallel_for(blocks, [&](std::size_t i) { a[i] = b[(i + 7) % blocks]; });
    if (std::string_view(arguments[1]) == "seen") perikit::parallel_for(blocks, [&](std::size_t i) { sum += a[i]; });
  }
  std::printf("%g\n", sum + a[0]);
}
