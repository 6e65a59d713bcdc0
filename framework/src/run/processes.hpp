#pragma once
#include <sys/types.h>

#include <cstddef>
#include <functional>
#include <map>

namespace perikit {

/// Pieces of work side by side, each in a process of its own. The calling process must not have computed in parallel before: a copied
/// process has none of the threads.
class Processes {
 public:
  /// Throws RunError where there is no process to be had.
  void start(std::size_t index, const std::function<void()>& work);
  /// Waits until one ends and says which; a stop that reaches this process alone is handed on.
  std::size_t wait();
  std::size_t running() const noexcept { return running_.size(); }

 private:
  std::map<pid_t, std::size_t> running_;
};

}  // namespace perikit
