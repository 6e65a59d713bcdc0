#pragma once
/// Which thread takes which indices of a loop: each begins with a share of neighbouring ones, the same in every loop of as many, so that what it wrote
/// is still in its own caches when it reads it, and helps others when nothing of its own is left.

#include <atomic>
#include <cstddef>
#include <memory>
#include <optional>
#include <thread>

#include "perikit/core/parallel.hpp"

namespace perikit::detail {

/// For the thread sanitizer neighbouring indices are always on different threads, whatever the machine is doing.
#if defined(__SANITIZE_THREAD__)
inline constexpr bool threads_keep_to_themselves = true;
#else
inline constexpr bool threads_keep_to_themselves = false;
#endif

/// Whose share of n indices an index belongs to.
inline std::size_t share_of(std::size_t i, std::size_t n, std::size_t threads) noexcept {
  return threads_keep_to_themselves ? i % threads : i * threads / n;
}

/// For loops that wait for something: briefly by themselves, then by leaving the core to others, of whom there may be more than cores.
class Patience {
 public:
  void wait() noexcept {
    if (++turns_ > 200) std::this_thread::yield();
  }

 private:
  int turns_ = 0;
};

/// Holds a lock while it lives. What is done meanwhile is short.
class Locked {
 public:
  explicit Locked(std::atomic_flag& flag) noexcept : flag_(flag) {
    for (Patience patience; flag_.test_and_set(std::memory_order_acquire);) patience.wait();
  }
  ~Locked() { flag_.clear(std::memory_order_release); }
  Locked(const Locked&) = delete;
  Locked& operator=(const Locked&) = delete;

 private:
  std::atomic_flag& flag_;
};

/// The indices [first, last) of a loop in which none waits for others.
class WorkStealing {
 public:
  WorkStealing(std::size_t first, std::size_t last, int threads, Sharing sharing)
      : threads_(static_cast<std::size_t>(threads)),
        helped_(sharing == Sharing::help && !threads_keep_to_themselves ? threads_ : 1),
        shares_(std::make_unique<Share[]>(threads_)) {
    const std::size_t n = last - first;
    for (std::size_t t = 0; t < threads_; ++t) {
      if (threads_keep_to_themselves) {
        shares_[t].next = first + t;
        shares_[t].last = last;
        shares_[t].step = threads_;
      } else {   // the first i with share_of(i, n, threads) == t
        shares_[t].next = first + (n * t + threads_ - 1) / threads_;
        shares_[t].last = first + (n * (t + 1) + threads_ - 1) / threads_;
      }
    }
  }

  /// The next index of this thread; none: nothing is left for it. team: how many threads there are, as many as shares, or fewer, which then do those
  /// of the others, too.
  std::optional<std::size_t> take(int thread, int team) noexcept {
    const auto own = static_cast<std::size_t>(thread);
    for (std::size_t t = own; t < threads_; t += static_cast<std::size_t>(team))
      if (const auto i = shares_[t].take()) return i;
    for (std::size_t k = 1; k < helped_; ++k)
      if (const auto i = shares_[(own + k) % threads_].take()) return i;
    return {};
  }

 private:
  struct alignas(64) Share {
    std::atomic<std::size_t> next{0};
    std::size_t last = 0, step = 1;

    std::optional<std::size_t> take() noexcept {
      if (next.load(std::memory_order_relaxed) >= last) return {};
      const std::size_t i = next.fetch_add(step, std::memory_order_relaxed);
      return i < last ? std::optional(i) : std::nullopt;
    }
  };
  std::size_t threads_, helped_;   ///< shares; of how many of them a thread takes
  std::unique_ptr<Share[]> shares_;
};

}  // namespace perikit::detail
