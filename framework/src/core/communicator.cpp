#include "perikit/core/communicator.hpp"

#include <utility>

namespace perikit {

namespace {

class Serial final : public Communicator {
 public:
  int rank() const noexcept override { return 0; }
  int size() const noexcept override { return 1; }
  double sum(double value) override { return value; }
  double largest(double value) override { return value; }
  void exchange(const std::vector<std::vector<double>>& to, std::vector<std::vector<double>>& from) override { from = to; }
};

thread_local Communicator* current = nullptr;

}  // namespace

Communicator& communicator() noexcept {
  static Serial serial;
  return current ? *current : serial;
}

CommunicatorScope::CommunicatorScope(Communicator& mine) noexcept : before_(std::exchange(current, &mine)) {}
CommunicatorScope::~CommunicatorScope() { current = before_; }

}  // namespace perikit
