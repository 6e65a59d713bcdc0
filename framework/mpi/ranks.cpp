/// The communicator over MPI: the one file of perikit that knows it. The program opens this library where a launcher has started
/// several processes (core/launch.cpp).

#define OMPI_SKIP_MPICXX
#define MPICH_SKIP_MPICXX
#include <mpi.h>

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <string_view>

#include "perikit/core/communicator.hpp"
#include "perikit/plugin/abi.hpp"

namespace perikit {

namespace {

constexpr std::size_t piece = std::size_t{1} << 30;  // MPI counts in int

class MpiExchange final : public ExchangePlan {
 public:
  MpiExchange(MPI_Comm world, std::span<const Message> messages) {
    for (const Message& message : messages)
      if (!message.from.empty())
        MPI_Recv_init(message.from.data(), static_cast<int>(message.from.size()), MPI_DOUBLE, message.rank, tag, world,
                      &requests_.emplace_back());
    for (const Message& message : messages)
      if (!message.to.empty())
        MPI_Send_init(message.to.data(), static_cast<int>(message.to.size()), MPI_DOUBLE, message.rank, tag, world,
                      &requests_.emplace_back());
  }
  MpiExchange(const MpiExchange&) = delete;
  MpiExchange& operator=(const MpiExchange&) = delete;
  ~MpiExchange() override {
    for (MPI_Request& request : requests_) MPI_Request_free(&request);
  }
  void start() override {
    // A rank whose part touches no other has no requests, and Open MPI refuses an array of none that has no address.
    if (!requests_.empty()) MPI_Startall(static_cast<int>(requests_.size()), requests_.data());
  }
  bool done(bool wait) override {
    const int count = static_cast<int>(requests_.size());
    int all = 1;
    if (wait)
      MPI_Waitall(count, requests_.data(), MPI_STATUSES_IGNORE);
    else
      MPI_Testall(count, requests_.data(), &all, MPI_STATUSES_IGNORE);
    return all != 0;
  }

 private:
  static constexpr int tag = 3;  // apart from exchanges without a plan
  std::vector<MPI_Request> requests_;
};

class MpiRanks final : public Communicator {
 public:
  MpiRanks() {
    int provided = 0;
    MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided);
    MPI_Comm_dup(MPI_COMM_WORLD, &world_);  // messages of libraries stay apart
    MPI_Comm_rank(world_, &rank_);
    MPI_Comm_size(world_, &size_);
  }
  ~MpiRanks() override {
    MPI_Comm_free(&world_);
    MPI_Finalize();
  }

  int rank() const noexcept override { return rank_; }
  int size() const noexcept override { return size_; }

  void sum(std::span<std::int64_t> numbers) override {
    MPI_Allreduce(MPI_IN_PLACE, numbers.data(), static_cast<int>(numbers.size()), MPI_INT64_T, MPI_SUM, world_);
  }

  double largest(double value) override {
    MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_DOUBLE, MPI_MAX, world_);
    return value;
  }

  void exchange(std::span<const Message> messages) override {
    requests_.clear();
    for (const Message& message : messages)
      if (!message.from.empty())
        MPI_Irecv(message.from.data(), static_cast<int>(message.from.size()), MPI_DOUBLE, message.rank, 0, world_,
                  &requests_.emplace_back());
    for (const Message& message : messages)
      if (!message.to.empty())
        MPI_Isend(message.to.data(), static_cast<int>(message.to.size()), MPI_DOUBLE, message.rank, 0, world_,
                  &requests_.emplace_back());
    MPI_Waitall(static_cast<int>(requests_.size()), requests_.data(), MPI_STATUSES_IGNORE);
  }

  std::unique_ptr<ExchangePlan> plan_exchange(std::vector<Message> messages) override {
    return std::make_unique<MpiExchange>(world_, messages);
  }

  std::vector<std::vector<std::byte>> gather(std::span<const std::byte> bytes) override {
    std::int64_t size = std::ssize(bytes);
    if (rank_ > 0) {
      MPI_Send(&size, 1, MPI_INT64_T, 0, 1, world_);
      for (std::size_t at = 0; at < bytes.size(); at += piece)
        MPI_Send(bytes.data() + at, static_cast<int>(std::min(piece, bytes.size() - at)), MPI_BYTE, 0, 2, world_);
      return {};
    }
    std::vector<std::vector<std::byte>> all{{bytes.begin(), bytes.end()}};
    for (int r = 1; r < size_; ++r) {
      MPI_Recv(&size, 1, MPI_INT64_T, r, 1, world_, MPI_STATUS_IGNORE);
      auto& of_rank = all.emplace_back(static_cast<std::size_t>(size));
      for (std::size_t at = 0; at < of_rank.size(); at += piece)
        MPI_Recv(of_rank.data() + at, static_cast<int>(std::min(piece, of_rank.size() - at)), MPI_BYTE, r, 2, world_,
                 MPI_STATUS_IGNORE);
    }
    return all;
  }

  void broadcast(std::vector<std::byte>& bytes) override {
    std::int64_t size = std::ssize(bytes);
    MPI_Bcast(&size, 1, MPI_INT64_T, 0, world_);
    bytes.resize(static_cast<std::size_t>(size));
    for (std::size_t at = 0; at < bytes.size(); at += piece)
      MPI_Bcast(bytes.data() + at, static_cast<int>(std::min(piece, bytes.size() - at)), MPI_BYTE, 0, world_);
  }

  void* mpi() noexcept override { return &world_; }

  [[noreturn]] void abort(int status) noexcept override {
    MPI_Abort(world_, status);
    std::_Exit(status);
  }

 private:
  MPI_Comm world_ = MPI_COMM_NULL;
  int rank_ = 0, size_ = 1;
  std::vector<MPI_Request> requests_;
};

}  // namespace

}  // namespace perikit

/// Null where the caller is another perikit.
PERIKIT_EXPORT perikit::Communicator* perikit_mpi_ranks(const char* build_id) {
  if (std::string_view(build_id) != PERIKIT_BUILD) return nullptr;
  return new perikit::MpiRanks();
}
