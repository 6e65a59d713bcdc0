#pragma once
/// Loops of which some indices wait for others.

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <type_traits>
#include <vector>

#include "core/threads/loop_times.hpp"
#include "perikit/core/parallel.hpp"

namespace perikit {

/// Which indices of a loop wait for which: an index begins when all those that it waits for have ended. What two of them do to
/// the same memory comes in one order where one waits for the other, if only by way of others, on any number of threads.
/// Otherwise a thread takes what may begin of its own share, the lowest indices first, and those that waited for them soon after, so that what they
/// share is still in the caches. Where none of its own may begin, it takes what may of others' shares.
class LoopOrder {
 public:
  /// late: by index, whether it reads what arrives, or waits for one that does; empty: none.
  explicit LoopOrder(std::shared_ptr<const LoopWaits> waits_for, std::vector<std::uint8_t> late = {});

  std::size_t size() const noexcept { return waits_for_->size(); }
  const std::shared_ptr<const LoopWaits>& waits_for() const noexcept { return waits_for_; }
  /// How many indices are not late; they come before all others.
  std::size_t early() const noexcept { return early_; }
  /// All indices in the order in which one thread takes them.
  const std::vector<std::int32_t>& turns();

  /// A new round, in which nothing has been taken yet.
  void begin(int threads);
  /// An index that may begin, late ones if they may, too; none: there is none now.
  std::optional<std::size_t> take(int thread, bool late = true) noexcept;
  void end(std::size_t i) noexcept;
  std::size_t taken() const noexcept { return taken_.load(std::memory_order_acquire); }

 private:
  /// What may begin of the share of a thread: a heap of places, the first in front.
  struct alignas(64) Share {
    std::atomic_flag locked;
    std::atomic<std::size_t> first{0};     ///< of them, for others to see; more than there are: there is none
    std::vector<std::int32_t> ready;
    std::vector<std::int32_t> at_once;     ///< those that wait for nothing
    void show() noexcept { first.store(ready.empty() ? SIZE_MAX : static_cast<std::size_t>(ready.front()), std::memory_order_relaxed); }
  };
  std::vector<std::int32_t> turns_of(std::size_t threads) const;
  void divide(int threads);
  void may_begin(std::size_t i) noexcept;
  std::optional<std::size_t> take_of(Share& share, std::size_t bound) noexcept;

  std::shared_ptr<const LoopWaits> waits_for_;
  std::vector<std::vector<std::int32_t>> followers_;
  std::vector<std::uint8_t> late_;
  std::size_t early_ = 0;
  std::size_t threads_ = 0;                                 ///< for which the following are
  std::vector<std::int32_t> turns_;                         ///< indices in the order in which a thread prefers them
  std::vector<std::int32_t> place_;                         ///< there, by index
  std::unique_ptr<Share[]> shares_;
  std::unique_ptr<std::atomic<std::int32_t>[]> awaited_;    ///< by index: how many that it waits for have not ended
  std::atomic<std::size_t> taken_{0};
};

namespace detail {
void parallel_for(LoopOrder& order, Arrival* arrival, void* context, void (*body)(void*, std::size_t));
}  // namespace detail

/// body(i) for i in [0, order.size()), those that wait for others after them. arrival: of what late indices read; null: it is
/// there.
template <class Body>
void parallel_for(LoopOrder& order, Body&& body, Arrival* arrival = nullptr) {
  detail::parallel_for(order, arrival, &body,
                       [](void* context, std::size_t i) { (*static_cast<std::remove_reference_t<Body>*>(context))(i); });
}

}  // namespace perikit
