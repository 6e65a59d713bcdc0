#include "perikit/core/memory.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>

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

}  // namespace perikit
