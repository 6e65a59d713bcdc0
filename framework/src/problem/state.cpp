#include "perikit/problem/state.hpp"

#include <algorithm>
#include <iterator>

#include "perikit/core/rank_values.hpp"
#include "perikit/core/errors.hpp"
#include "problem/snapshot.hpp"

namespace perikit {

State::State(const Body& body) : body_(&body) {
  displacement_ = declare("displacement", body.dimension());
  internal_force_ = declare("internal_force", body.dimension());
}

FieldView State::declare(const std::string& name, int components) {
  const auto [entry, fresh] = fields_.try_emplace(name);
  if (fresh) entry->second = body_->make_field(components);
  return entry->second;
}

std::span<double> State::declare_numbers(const std::string& name, std::size_t count) {
  std::vector<double>& numbers = numbers_[name];
  if (numbers.size() < count) numbers.resize(count, 0.0);
  return numbers;
}

std::size_t State::bytes() const noexcept {
  std::size_t total = 0;
  for (const auto& [name, field] : fields_) total += field.bytes();
  return total;
}

namespace {

/// Points and images that no other rank has.
std::vector<std::int32_t> own_points(const Body& body) {
  std::vector<std::int32_t> own;
  std::ranges::copy_if(body.internal(), std::back_inserter(own),
                       [&](std::int32_t p) { return body.owns(static_cast<std::size_t>(p)); });
  return own;
}

}  // namespace

void State::write(ByteWriter& out) const {
  const std::vector<std::int32_t> owned = own_points(*body_);
  const auto places = body_->places().place;
  std::vector<double> values, to;  // of owned points; where those of all ranks go
  if (!places.empty()) {
    for (const std::int32_t p : owned) values.push_back(static_cast<double>(places[static_cast<std::size_t>(p)]));
    to = gathered<double>(values);
  }
  out.value(time);
  out.value(step);
  out.value(energies);
  out.value(static_cast<std::uint64_t>(numbers_.size()));
  for (const auto& [name, values] : numbers_) {
    out.text(name);
    out.numbers(values);
  }
  out.value(static_cast<std::uint64_t>(fields_.size()));
  for (const auto& [name, field] : fields_) {
    out.text(name);
    out.value(static_cast<std::int64_t>(field.components()));
    if (places.empty()) {
      out.bytes(field.data(), field.size() * sizeof(double));
      continue;
    }
    for (int c = 0; c < field.components(); ++c) {
      for (std::size_t n = 0; n < owned.size(); ++n) values[n] = field.component(c)[owned[n]];
      const std::vector<double> from = gathered<double>(values);
      if (from.empty()) continue;
      std::vector<double> all(body_->stride_of_all_ranks(), 0.0);
      for (std::size_t n = 0; n < from.size(); ++n) all[static_cast<std::size_t>(to[n])] = from[n];
      out.bytes(all.data(), all.size() * sizeof(double));
    }
  }
}

void State::read(ByteReader& in) {
  const auto places = body_->places().place;
  time = in.value<double>();
  step = in.value<std::int64_t>();
  energies = in.value<Energies>();
  for (auto& [name, values] : numbers_) std::ranges::fill(values, 0.0);
  for (auto left = in.value<std::uint64_t>(); left > 0; --left) {
    const std::string name = in.text();
    const auto count = in.value<std::uint64_t>();
    if (count > 1u << 20) throw InputError("the saved state is damaged");
    in.bytes(declare_numbers(name, count).data(), count * sizeof(double));
  }
  for (auto& [name, field] : fields_) field.fill(0.0);
  for (auto left = in.value<std::uint64_t>(); left > 0; --left) {
    const std::string name = in.text();
    const auto components = in.value<std::int64_t>();
    if (components < 1 || components > 1024) throw InputError("the saved state is damaged");
    const FieldView field = declare(name, static_cast<int>(components));
    if (field.components != components) throw InputError("the saved state is damaged");
    if (places.empty()) {
      in.bytes(field.data, field.size() * sizeof(double));
      continue;
    }
    std::vector<double> all(body_->stride_of_all_ranks());
    for (int c = 0; c < field.components; ++c) {
      in.bytes(all.data(), all.size() * sizeof(double));
      for (const std::int32_t p : own_points(*body_))
        field.component(c)[p] = all[static_cast<std::size_t>(places[static_cast<std::size_t>(p)])];
    }
  }
}

}  // namespace perikit
