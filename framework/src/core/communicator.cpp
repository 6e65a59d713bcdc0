#include "perikit/core/communicator.hpp"

#include <cstring>
#include <utility>

#include "perikit/core/serial_communicator.hpp"

namespace perikit {

Communicator::~Communicator() = default;

namespace {

class LateExchange final : public ExchangePlan {
 public:
  LateExchange(Communicator& ranks, std::vector<Message> messages) : ranks_(ranks), messages_(std::move(messages)) {}
  void start() override {}
  bool done(bool wait) override {
    if (wait) ranks_.exchange(messages_);
    return wait;
  }

 private:
  Communicator& ranks_;
  std::vector<Message> messages_;
};

thread_local Communicator* current = nullptr;

}  // namespace

std::unique_ptr<ExchangePlan> Communicator::plan_exchange(std::vector<Message> messages) {
  return std::make_unique<LateExchange>(*this, std::move(messages));
}

Communicator& communicator() noexcept {
  static SerialCommunicator serial;
  return current ? *current : serial;
}

CommunicatorScope::CommunicatorScope(Communicator& mine) noexcept : before_(std::exchange(current, &mine)) {}
CommunicatorScope::~CommunicatorScope() {
  current = before_;
}

std::vector<std::vector<std::byte>> exchange_among_all(const std::vector<std::vector<std::byte>>& to) {
  Communicator& ranks = communicator();
  const auto size = static_cast<std::size_t>(ranks.size()), own = static_cast<std::size_t>(ranks.rank());
  const auto numbers = [](std::size_t bytes) { return (bytes + sizeof(double) - 1) / sizeof(double); };
  std::vector<double> send_sizes(size), sizes(size);
  std::vector<std::vector<double>> send(size), received(size);
  std::vector<Message> of_sizes, messages;
  for (std::size_t r = 0; r < size; ++r) {
    if (r == own) continue;
    send_sizes[r] = static_cast<double>(to[r].size());
    of_sizes.push_back({static_cast<int>(r), {&send_sizes[r], 1}, {&sizes[r], 1}});
  }
  ranks.exchange(of_sizes);
  for (std::size_t r = 0; r < size; ++r) {
    if (r == own) continue;
    send[r].resize(numbers(to[r].size()));
    if (!to[r].empty()) std::memcpy(send[r].data(), to[r].data(), to[r].size());
    received[r].resize(numbers(static_cast<std::size_t>(sizes[r])));
    messages.push_back({static_cast<int>(r), send[r], received[r]});
  }
  ranks.exchange(messages);
  std::vector<std::vector<std::byte>> from(size);
  for (std::size_t r = 0; r < size; ++r) {
    if (r == own) {
      from[r] = to[r];
      continue;
    }
    from[r].resize(static_cast<std::size_t>(sizes[r]));
    if (!from[r].empty()) std::memcpy(from[r].data(), received[r].data(), from[r].size());
  }
  return from;
}

std::string first_message(const std::string& mine) {
  if (communicator().largest(mine.empty() ? 0 : 1) == 0) return {};
  std::vector<std::byte> first;
  for (const std::vector<std::byte>& of_rank : communicator().gather(std::as_bytes(std::span(mine))))
    if (first.empty()) first = of_rank;
  communicator().broadcast(first);
  return {reinterpret_cast<const char*>(first.data()), first.size()};
}

double total_over_ranks(ExactSum sum) {
  if (communicator().size() > 1) {
    sum.normalize();
    communicator().sum(sum.numbers());
  }
  return sum.value();
}

}  // namespace perikit
