#pragma once
/// Long pieces of work that ask nobody whether the run is to end.

#include <chrono>
#include <functional>
#include <future>
#include <thread>
#include <utility>

namespace perikit {

/// Does `work` on a thread of its own, and asks meanwhile whether the run goes on (empty: it does, and `work` is done here). False where the run is to end before
/// the work is done: it is left to itself then, and all that it uses must stay until the program ends.
template <class Work>
bool work_apart(const std::function<bool()>& goes_on, Work work) {
  if (!goes_on) {
    work();
    return true;
  }
  std::packaged_task<void()> task(std::move(work));
  std::future<void> end = task.get_future();
  std::thread worker(std::move(task));
  while (end.wait_for(std::chrono::milliseconds(100)) != std::future_status::ready) {
    if (goes_on()) continue;
    worker.detach();
    return false;
  }
  worker.join();
  end.get();   // throws what the work threw
  return true;
}

}  // namespace perikit
