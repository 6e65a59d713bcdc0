#pragma once
/// What the processes of one run have to tell each other. Everything that is global goes through here, and nothing else does, so
/// that integrators and parts need not know how many processes there are. Serial unless a CommunicatorScope says otherwise. All
/// ranks must call what says so, in the same order, from the thread that runs them.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "perikit/core/exact_sum.hpp"

namespace perikit {

/// Numbers that go to a rank and come from it; what is `to` here has the size of `from` there.
struct Message {
  int rank;
  std::span<const double> to;
  std::span<double> from;
};

/// An exchange that is made again and again, from and to the same memory.
class ExchangePlan {
 public:
  virtual ~ExchangePlan() = default;
  /// Numbers are on their way from now on: those to send may not change, and those to come may not be read, until the exchange is
  /// done.
  virtual void start() = 0;
  /// Whether all have come and gone; waits until they have where it may.
  virtual bool done(bool wait) = 0;
};

class Communicator {
 public:
  virtual ~Communicator();
  virtual int rank() const noexcept = 0;
  virtual int size() const noexcept = 0;
  /// Whether the others are there; a rank whose others are not sets up its part as if they were.
  virtual bool complete() const noexcept { return true; }

  /// numbers <- their sums over all ranks. All ranks must call it.
  virtual void sum(std::span<std::int64_t> numbers) = 0;
  /// Over all ranks, which must all call it.
  virtual double largest(double value) = 0;
  /// Sends and receives all of them, from at most one message a rank. A rank calls it together with those that it names.
  virtual void exchange(std::span<const Message> messages) = 0;
  /// The same, to be made many times. A rank starts it, and waits for it, together with those that it names, and the plan goes
  /// before the communicator does. Unless a communicator knows better, nothing happens before somebody waits.
  virtual std::unique_ptr<ExchangePlan> plan_exchange(std::vector<Message> messages);
  /// On rank 0 the bytes of every rank, in their order; empty on the others. All ranks must call it.
  virtual std::vector<std::vector<std::byte>> gather(std::span<const std::byte> bytes) = 0;
  /// bytes <- those of rank 0. All ranks must call it.
  virtual void broadcast(std::vector<std::byte>& bytes) = 0;
  /// The MPI_Comm behind it, for libraries that speak MPI themselves; null where there is none.
  virtual void* mpi() noexcept { return nullptr; }
  /// Ends all ranks with this status, at once and whatever they are doing.
  [[noreturn]] virtual void abort(int status) noexcept = 0;
};

/// That of this thread.
Communicator& communicator() noexcept;

/// The communicator of this thread while the scope lives.
class CommunicatorScope {
 public:
  explicit CommunicatorScope(Communicator& mine) noexcept;
  ~CommunicatorScope();
  CommunicatorScope(const CommunicatorScope&) = delete;
  CommunicatorScope& operator=(const CommunicatorScope&) = delete;

 private:
  Communicator* before_;
};

/// The message of the lowest rank that has one, on all; empty where none has. All ranks must call it.
std::string first_message(const std::string& mine);

/// The sum of what all ranks have added, rounded once: the same bits however the terms lie on ranks. All ranks must call it.
double total_over_ranks(ExactSum sum);

/// Numbers of the launcher that has started this process (mpirun, srun and their like), from its environment.
struct Launch {
  int rank = 0, size = 1;
  const char* variable = nullptr;  ///< that says how many there are; null: started by none
};
Launch find_launch();

/// The ranks that `launch` speaks of, by the library of MPI, which is opened only here. Null for one process. Throws InputError
/// where the library is missing or knows of other numbers.
std::unique_ptr<Communicator> join_ranks(const Launch& launch);

}  // namespace perikit
