#include "problem/ghosts.hpp"

#include <chrono>

namespace perikit {

Ghosts::Ghosts(const Partition& partition, int components) {
  for (std::size_t k = 0; k < partition.lent().size(); ++k) {
    if (partition.lent()[k].empty() && partition.borrowed()[k].empty()) continue;
    Neighbour& neighbour = neighbours_.emplace_back(Neighbour{static_cast<int>(k), partition.lent()[k], partition.borrowed()[k]});
    neighbour.to.resize(neighbour.lent.size() * static_cast<std::size_t>(components));
    neighbour.from.resize(neighbour.borrowed.size() * static_cast<std::size_t>(components));
  }
  std::vector<Message> messages;
  for (Neighbour& neighbour : neighbours_) messages.push_back({neighbour.rank, neighbour.to, neighbour.from});
  plan_ = communicator().plan_exchange(std::move(messages));
}

void Ghosts::start(FieldView field) {
  for (Neighbour& neighbour : neighbours_) {
    double* to = neighbour.to.data();
    for (int c = 0; c < field.components; ++c)
      for (const std::int32_t p : neighbour.lent) *to++ = field.component(c)[p];
  }
  arriving_ = field;
  plan_->start();
  expect();
}

bool Ghosts::come(bool wait) {
  if (!wait) return plan_->done(false);
  const auto before = std::chrono::steady_clock::now();
  plan_->done(true);
  waited_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - before).count();
  return true;
}

void Ghosts::put() {
  for (const Neighbour& neighbour : neighbours_) {
    const double* from = neighbour.from.data();
    for (int c = 0; c < arriving_.components; ++c)
      for (const std::int32_t p : neighbour.borrowed) arriving_.component(c)[p] = *from++;
  }
}

void Ghosts::clear(FieldView field) const {
  for (const Neighbour& neighbour : neighbours_)
    for (int c = 0; c < field.components; ++c)
      for (const std::int32_t p : neighbour.borrowed) field.component(c)[p] = 0.0;
}

std::size_t Ghosts::size() const noexcept {
  std::size_t count = 0;
  for (const Neighbour& neighbour : neighbours_) count += neighbour.borrowed.size();
  return count;
}

std::size_t Ghosts::sent() const noexcept {
  std::size_t count = 0;
  for (const Neighbour& neighbour : neighbours_) count += neighbour.lent.size();
  return count;
}

}  // namespace perikit
