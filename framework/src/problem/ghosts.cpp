#include "perikit/problem/ghosts.hpp"

#include "perikit/core/communicator.hpp"

namespace perikit {

Ghosts::Ghosts(const Partition& partition, const Body& part) {
  const auto internal = [&](const Points& inputs) {
    Points points;
    for (const auto& of_rank : inputs) {
      points.emplace_back();
      for (const std::int32_t input : of_rank) points.back().push_back(part.internal()[static_cast<std::size_t>(partition.place(input))]);
    }
    return points;
  };
  lent_ = internal(partition.lent());
  borrowed_ = internal(partition.borrowed());
}

std::vector<std::vector<double>> Ghosts::gather(FieldView field, const Points& points) {
  std::vector<std::vector<double>> values;
  for (const auto& of_rank : points) {
    values.emplace_back();
    for (int c = 0; c < field.components; ++c)
      for (const std::int32_t p : of_rank) values.back().push_back(field.component(c)[p]);
  }
  return values;
}

void Ghosts::forward(FieldView field) const {
  std::vector<std::vector<double>> values;
  communicator().exchange(gather(field, lent_), values);
  for (std::size_t k = 0; k < borrowed_.size(); ++k) {
    auto value = values[k].begin();
    for (int c = 0; c < field.components; ++c)
      for (const std::int32_t p : borrowed_[k]) field.component(c)[p] = *value++;
  }
}

void Ghosts::accumulate(FieldView field) const {
  std::vector<std::vector<double>> values;
  communicator().exchange(gather(field, borrowed_), values);
  for (std::size_t k = 0; k < lent_.size(); ++k) {
    auto value = values[k].begin();
    for (int c = 0; c < field.components; ++c) {
      for (const std::int32_t p : lent_[k]) field.component(c)[p] += *value++;
      for (const std::int32_t p : borrowed_[k]) field.component(c)[p] = 0.0;
    }
  }
}

}  // namespace perikit
