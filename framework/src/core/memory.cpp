#include "perikit/core/memory.hpp"

#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <new>

#include "perikit/core/field.hpp"

namespace perikit {

double memory_limit() noexcept {
  double limit = static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGESIZE));
  if (std::ifstream file("/sys/fs/cgroup/memory.max"); file) {
    double bytes = 0;
    if (file >> bytes) limit = std::min(limit, bytes);  // "max": no limit
  }
  rlimit shell{};
  if (getrlimit(RLIMIT_AS, &shell) == 0 && shell.rlim_cur != RLIM_INFINITY)
    limit = std::min(limit, static_cast<double>(shell.rlim_cur));
  return limit;
}

void* detail::allocate_aligned(std::size_t bytes) {
  constexpr std::size_t huge = std::size_t{1} << 21;
  const bool large = bytes >= 4 * huge;
  const std::size_t alignment = large ? huge : 64;
  void* const memory = std::aligned_alloc(alignment, std::max(alignment, (bytes + alignment - 1) / alignment * alignment));
  if (!memory) throw std::bad_alloc();
  if (large) madvise(memory, bytes / huge * huge, MADV_HUGEPAGE);   // whole ones only; where there are none, nothing is lost
  return memory;
}

void detail::free_aligned(void* memory) noexcept { std::free(memory); }

}  // namespace perikit
