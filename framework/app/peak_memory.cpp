#include "peak_memory.hpp"

#include <malloc.h>

#include <fstream>
#include <string>

#include "perikit/core/communicator.hpp"

namespace perikit::app {

namespace {

constexpr double bytes_of_program = 19e6, bytes_of_rank = 32e6;  // of one process, and of one of several, with MPI's libraries

/// A line of /proc/self/status.
double status(const std::string& wanted) {
  std::ifstream file("/proc/self/status");
  for (std::string name, line; file >> name && std::getline(file, line);)
    if (name == wanted) return 1024 * std::stod(line);
  return 0;
}

}  // namespace

PeakMemory::PeakMemory() {
  malloc_trim(0);
  before_ = status("VmRSS:");
  forget();
}

void PeakMemory::forget() {
  malloc_trim(0);
  std::ofstream("/proc/self/clear_refs") << 5;
}

double PeakMemory::bytes() const {
  const double peak = status("VmHWM:");
  return peak > 0 ? peak - before_ + (communicator().size() > 1 ? bytes_of_rank : bytes_of_program) : 0;
}

}  // namespace perikit::app
