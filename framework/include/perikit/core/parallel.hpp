#pragma once
/// The one place that starts threads. Bodies must not throw; loops are over fixed blocks, so results never depend on the
/// number of threads.

#include <atomic>
#include <cstddef>
#include <type_traits>

namespace perikit {

/// Number of threads that parallel_for uses; at least 1.
int thread_count() noexcept;
void set_thread_count(int n) noexcept;
/// 0 ... thread_count() - 1 inside a parallel_for, else 0: for choosing scratch memory, never for choosing work.
int thread_index() noexcept;

/// Values that are on their way while a loop runs. The thread that runs the loop looks after them, and no other calls what is not
/// const.
class Arrival {
 public:
  virtual ~Arrival() = default;
  /// On their way; else they are where they are read.
  bool pending() const noexcept { return pending_.load(std::memory_order_acquire); }
  /// Puts them there if they have come.
  void look() { end(false); }
  /// Waits for them, and puts them there.
  void finish() { end(true); }

 protected:
  /// They are on their way from now on.
  void expect() noexcept { pending_.store(true, std::memory_order_relaxed); }

 private:
  /// Whether they have come; not before they have where it may wait.
  virtual bool come(bool wait) = 0;
  virtual void put() = 0;
  void end(bool wait) {
    if (!pending() || !come(wait)) return;
    put();
    pending_.store(false, std::memory_order_release);
  }

  std::atomic<bool> pending_{false};
};

/// The indices of a loop from `first` on read what `arrival` brings; those before them do not, and wait for none of those.
struct LateIndices {
  std::size_t first = 0;
  Arrival* arrival = nullptr;  ///< null: nothing is on its way
  bool any() const noexcept { return arrival && arrival->pending(); }
};

/// What a thread does that has done its own share of a loop.
enum class Sharing {
  help,   ///< it takes indices of others
  keep,   ///< nothing: for loops whose indices take equally long, and less than it takes to fetch from another core what it wrote
};

namespace detail {
void parallel_for(std::size_t n, LateIndices late, Sharing sharing, void* context, void (*body)(void*, std::size_t));
}  // namespace detail

/// body(i) for i in [0, n), in any order, on all threads, each of which begins with a row of indices of its own, the same in loops of as many. body
/// must be noexcept in effect. What arrives has arrived after the loop.
template <class Body>
void parallel_for(std::size_t n, Body&& body, LateIndices late = {}, Sharing sharing = Sharing::help) {
  detail::parallel_for(n, late, sharing, &body,
                       [](void* context, std::size_t i) { (*static_cast<std::remove_reference_t<Body>*>(context))(i); });
}

}  // namespace perikit
