#pragma once
/// Ranks that are threads of one process: what a run on several ranks does, without MPI and its start.

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstdlib>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <thread>
#include <utility>
#include <vector>

#include "perikit/core/communicator.hpp"

namespace perikit {

/// A barrier whose threads sleep until the last one comes. Those of std::barrier first give way to others by turns, of which each takes milliseconds where the
/// machine has more to do than cores: a hundred times as long.
class Barrier {
 public:
  explicit Barrier(int threads) : expected_(threads) {}
  void arrive_and_wait() {
    std::unique_lock lock(mutex_);
    const unsigned round = round_;
    if (++arrived_ == expected_) next_round();
    else all_came_.wait(lock, [&] { return round_ != round; });
  }
  /// And comes no more.
  void arrive_and_drop() {
    const std::scoped_lock lock(mutex_);
    if (--expected_ == arrived_) next_round();
  }

 private:
  void next_round() {
    arrived_ = 0;
    ++round_;
    all_came_.notify_all();
  }
  int expected_, arrived_ = 0;
  unsigned round_ = 0;
  std::mutex mutex_;
  std::condition_variable all_came_;
};

/// What the ranks share: one slot each.
struct Meeting {
  explicit Meeting(int ranks)
      : barrier(ranks),
        numbers(static_cast<std::size_t>(ranks)),
        messages(numbers.size()),
        counts(numbers.size()),
        bytes(numbers.size()) {}
  Barrier barrier;
  std::atomic<bool> failed{false};   ///< whether a rank has thrown, and comes no more
  std::vector<double> numbers;
  std::vector<std::span<const Message>> messages;
  std::vector<std::vector<std::int64_t>> counts;
  std::vector<std::vector<std::byte>> bytes;
};

/// Thrown on ranks that meet when another has thrown.
struct OtherRankFailed {};

class ThreadRank final : public Communicator {
 public:
  ThreadRank(Meeting& meeting, int rank) : meeting_(meeting), rank_(rank) {}
  int rank() const noexcept override { return rank_; }
  int size() const noexcept override { return static_cast<int>(meeting_.numbers.size()); }

  void sum(std::span<std::int64_t> numbers) override {
    meeting_.counts[mine()].assign(numbers.begin(), numbers.end());
    together([&] {
      std::fill(numbers.begin(), numbers.end(), 0);
      for (const auto& of_rank : meeting_.counts)
        for (std::size_t k = 0; k < numbers.size(); ++k) numbers[k] += of_rank[k];
    });
  }
  double largest(double value) override {
    meeting_.numbers[mine()] = value;
    together([&] {
      for (const double other : meeting_.numbers) value = std::max(value, other);
    });
    return value;
  }
  /// A meeting of all ranks, though each names few.
  void exchange(std::span<const Message> messages) override {
    ++exchanges;
    meeting_.messages[mine()] = messages;
    together([&] {
      for (const Message& message : messages)
        for (const Message& theirs : meeting_.messages[static_cast<std::size_t>(message.rank)])
          if (theirs.rank == rank_) std::copy(theirs.to.begin(), theirs.to.end(), message.from.begin());
    });
  }
  /// Nothing arrives before somebody waits.
  std::unique_ptr<ExchangePlan> plan_exchange(std::vector<Message> messages) override {
    return std::make_unique<Plan>(*this, std::move(messages));
  }
  std::vector<std::vector<std::byte>> gather(std::span<const std::byte> bytes) override {
    meeting_.bytes[mine()].assign(bytes.begin(), bytes.end());
    std::vector<std::vector<std::byte>> all;
    together([&] {
      if (rank_ == 0) all = meeting_.bytes;
    });
    return all;
  }
  void broadcast(std::vector<std::byte>& bytes) override {
    if (rank_ == 0) meeting_.bytes[0] = bytes;
    together([&] { bytes = meeting_.bytes[0]; });
  }
  [[noreturn]] void abort(int status) noexcept override { std::_Exit(status); }

  int exchanges = 0;
  int looks = 0;  ///< that did not wait for what was on its way

 private:
  class Plan final : public ExchangePlan {
   public:
    Plan(ThreadRank& rank, std::vector<Message> messages) : rank_(rank), messages_(std::move(messages)) {}
    void start() override {}
    bool done(bool wait) override {
      if (wait) rank_.exchange(messages_);
      else ++rank_.looks;
      return wait;
    }

   private:
    ThreadRank& rank_;
    std::vector<Message> messages_;
  };
  std::size_t mine() const noexcept { return static_cast<std::size_t>(rank_); }
  /// Reads what all have written, before any writes again.
  template <class Read>
  void together(Read&& read) {
    meeting_.barrier.arrive_and_wait();
    if (meeting_.failed.load()) throw OtherRankFailed();
    read();
    meeting_.barrier.arrive_and_wait();
  }

  Meeting& meeting_;
  int rank_;
};

/// work(communicator) on so many ranks at once. What one of them throws is thrown again, the lowest one's where several do; where the others meet
/// then, they throw, too.
inline void on_ranks(int ranks, const std::function<void(ThreadRank&)>& work) {
  Meeting meeting(ranks);
  std::vector<std::exception_ptr> failures(static_cast<std::size_t>(ranks));
  std::vector<std::thread> threads;
  for (int r = 0; r < ranks; ++r)
    threads.emplace_back([&, r] {
      ThreadRank mine(meeting, r);
      const CommunicatorScope scope(mine);
      try {
        work(mine);
      } catch (const OtherRankFailed&) {
        meeting.barrier.arrive_and_drop();
      } catch (...) {
        failures[static_cast<std::size_t>(r)] = std::current_exception();
        meeting.failed.store(true);
        meeting.barrier.arrive_and_drop();
      }
    });
  for (std::thread& thread : threads) thread.join();
  for (const std::exception_ptr& failure : failures)
    if (failure) std::rethrow_exception(failure);
}

}  // namespace perikit
