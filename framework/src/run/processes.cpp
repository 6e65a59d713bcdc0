#include "run/processes.hpp"

#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>

#include "perikit/core/errors.hpp"
#include "run/simulation.hpp"

namespace perikit {

void Processes::start(std::size_t index, const std::function<void()>& work) {
  std::fflush(nullptr);
  const pid_t child = ::fork();
  if (child < 0) throw RunError(fmt::format("no process of its own for a run: {}", std::strerror(errno)));
  if (child == 0) {
    try {
      work();
      ::_exit(0);
    } catch (...) {
      ::_exit(1);   // what is missing of its results tells the caller
    }
  }
  running_[child] = index;
}

std::size_t Processes::wait() {
  for (;;) {
    int status = 0;
    const pid_t ended = ::waitpid(-1, &status, 0);
    if (ended < 0 && errno == EINTR && stop_requested()) {
      for (const auto& [child, index] : running_) ::kill(child, SIGTERM);
    }
    const auto child = running_.find(ended);
    if (child == running_.end()) continue;
    const std::size_t index = child->second;
    running_.erase(child);
    return index;
  }
}

}  // namespace perikit
