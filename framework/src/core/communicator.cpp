#include "perikit/core/communicator.hpp"

#include <utility>

#include "perikit/core/serial_communicator.hpp"

namespace perikit {

Communicator::~Communicator() = default;

namespace {

thread_local Communicator* current = nullptr;

}  // namespace

Communicator& communicator() noexcept {
  static SerialCommunicator serial;
  return current ? *current : serial;
}

CommunicatorScope::CommunicatorScope(Communicator& mine) noexcept : before_(std::exchange(current, &mine)) {}
CommunicatorScope::~CommunicatorScope() {
  current = before_;
}

double total_over_ranks(ExactSum sum) {
  if (communicator().size() > 1) {
    sum.normalize();
    communicator().sum(sum.numbers());
  }
  return sum.value();
}

}  // namespace perikit
