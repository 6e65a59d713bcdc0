#pragma once
/// The one place that starts threads. Bodies must not throw; loops are over fixed blocks, so results never depend on the
/// number of threads.

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <type_traits>
#include <vector>

namespace perikit {

/// Number of threads that parallel_for uses; at least 1.
int thread_count() noexcept;
void set_thread_count(int n) noexcept;
/// 0 ... thread_count() - 1 inside a parallel_for, else 0: for choosing scratch memory, never for choosing work.
int thread_index() noexcept;

/// By index of a loop: those that it waits for, and never, by way of others, itself.
using LoopWaits = std::vector<std::vector<std::int32_t>>;

/// Which indices of a loop wait for which: an index begins when all those that it waits for have ended. What two of them do to
/// the same memory comes in one order where one waits for the other, if only by way of others, on any number of threads.
/// Otherwise the lowest indices come first, and those that waited for them soon after, so that what they share is still in the
/// caches.
class LoopOrder {
 public:
  LoopOrder() = default;
  /// late: by index, whether it reads what arrives, or waits for one that does; empty: none.
  explicit LoopOrder(LoopWaits waits_for, std::vector<std::uint8_t> late = {});

  std::size_t size() const noexcept { return waits_for_ ? waits_for_->size() : 0; }
  std::shared_ptr<const LoopWaits> waits_for() const noexcept { return waits_for_; }
  /// How many indices are not late; they come before all others.
  std::size_t early() const noexcept { return early_; }

  /// For parallel_for: a new round, in which nothing has ended yet; the index that comes as number k; wait until `i` may begin;
  /// it has ended.
  void begin(int threads);
  std::size_t turn(std::size_t k) const noexcept { return static_cast<std::size_t>(turns_[k]); }
  void wait(std::size_t i) const noexcept;
  void end(std::size_t i) noexcept { ended_[i].store(round_, std::memory_order_release); }

 private:
  std::shared_ptr<const LoopWaits> waits_for_;
  std::vector<std::uint8_t> late_;
  std::size_t early_ = 0;
  std::vector<std::int32_t> turns_;                       ///< indices in the order in which threads take them
  int threads_ = 0;                                       ///< for which they are in that order
  std::unique_ptr<std::atomic<std::uint32_t>[]> ended_;   ///< the last round in which it did
  std::uint32_t round_ = 0;
};

/// The order in which so many threads take the indices of a loop that wait for others, each for what follows it: the lowest first
/// that wait for nothing among the last ones. One thread follows up what it has begun; several leave each other time to end.
std::vector<std::int32_t> loop_turns(const LoopWaits& waits_for, int threads);

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

namespace detail {
void parallel_for(std::size_t n, LateIndices late, void* context, void (*body)(void*, std::size_t));
void parallel_for(LoopOrder& order, Arrival* arrival, void* context, void (*body)(void*, std::size_t));
}  // namespace detail

/// body(i) for i in [0, n), in any order, on all threads. body must be noexcept in effect. What arrives has arrived after the
/// loop.
template <class Body>
void parallel_for(std::size_t n, Body&& body, LateIndices late = {}) {
  detail::parallel_for(n, late, &body,
                       [](void* context, std::size_t i) { (*static_cast<std::remove_reference_t<Body>*>(context))(i); });
}

/// body(i) for i in [0, order.size()), those that wait for others after them. arrival: of what late indices read; null: it is
/// there.
template <class Body>
void parallel_for(LoopOrder& order, Body&& body, Arrival* arrival = nullptr) {
  detail::parallel_for(order, arrival, &body,
                       [](void* context, std::size_t i) { (*static_cast<std::remove_reference_t<Body>*>(context))(i); });
}

}  // namespace perikit
