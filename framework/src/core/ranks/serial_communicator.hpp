#pragma once
/// The communicators of a process without others.

#include <cstdlib>
#include <span>
#include <vector>

#include "perikit/core/communicator.hpp"

namespace perikit {

class SerialCommunicator : public Communicator {
 public:
  int rank() const noexcept override { return 0; }
  int size() const noexcept override { return 1; }
  void sum(std::span<std::int64_t>) override {}
  double largest(double value) override { return value; }
  void exchange(std::span<const Message>) override {}
  std::vector<std::vector<std::byte>> gather(std::span<const std::byte> bytes) override { return {{bytes.begin(), bytes.end()}}; }
  void broadcast(std::vector<std::byte>&) override {}
  [[noreturn]] void abort(int status) noexcept override { std::_Exit(status); }
};

/// A rank whose others are not there: it sets itself up as if they were.
class LoneRank final : public SerialCommunicator {
 public:
  LoneRank(int rank, int size) : rank_(rank), size_(size) {}
  int rank() const noexcept override { return rank_; }
  int size() const noexcept override { return size_; }
  bool complete() const noexcept override { return false; }

 private:
  int rank_, size_;
};

}  // namespace perikit
