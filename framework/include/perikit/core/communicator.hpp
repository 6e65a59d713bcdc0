#pragma once
/// What the processes of one run have to tell each other: global sums and pieces of fields. Everything that is global goes through
/// here, and nothing else does, so that integrators and parts need not know how many processes there are. Serial unless a
/// CommunicatorScope says otherwise.

#include <vector>

namespace perikit {

class Communicator {
 public:
  virtual ~Communicator() = default;
  virtual int rank() const noexcept = 0;
  virtual int size() const noexcept = 0;
  /// Over all ranks, which must all call it; added in the order of the ranks, the same bits on each.
  virtual double sum(double value) = 0;
  virtual double largest(double value) = 0;
  /// Gives to[k] to rank k, and gets from[k] from it; sizes must agree. All ranks must call it.
  virtual void exchange(const std::vector<std::vector<double>>& to, std::vector<std::vector<double>>& from) = 0;
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

}  // namespace perikit
