#include "perikit/problem/state.hpp"

#include <algorithm>
#include <utility>

#include "core/ranks/numbered_rows.hpp"
#include "perikit/core/errors.hpp"
#include "problem/snapshot.hpp"

namespace perikit {

State::State(Points points) : points_(std::move(points)) {
  displacement_ = declare("displacement", points_.dimension());
  internal_force_ = declare("internal_force", points_.dimension());
}

FieldView State::declare(const std::string& name, int components) {
  const auto [entry, fresh] = fields_.try_emplace(name);
  if (fresh) entry->second = points_.make_field(components);
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

/// Points and images here that no other rank has, in the order of fields over the points of all ranks.
struct OwnPlaces {
  explicit OwnPlaces(const Points& all) {
    for (const std::int32_t p : all.live())
      if (all.owns(static_cast<std::size_t>(p))) points.push_back(p);
    const auto place = all.places().place;
    std::ranges::sort(points, {}, [&](std::int32_t p) { return place[static_cast<std::size_t>(p)]; });
    for (const std::int32_t p : points) places.push_back(place[static_cast<std::size_t>(p)]);
  }
  std::vector<std::int32_t> points;
  std::vector<std::int64_t> places;
};

/// visit(first, count) of the pieces of a component over the points of all ranks.
template <class Visit>
void each_piece(std::size_t stride, Visit&& visit) {
  for (std::size_t first = 0; first < stride; first += rows_of_piece) visit(first, std::min(rows_of_piece, stride - first));
}

}  // namespace

std::uint64_t State::written() const noexcept {
  constexpr std::uint64_t number = 8;
  std::uint64_t size = sizeof time + sizeof step + sizeof energies + 2 * number;
  for (const auto& [name, values] : numbers_) size += 2 * number + name.size() + values.size() * sizeof(double);
  for (const auto& [name, field] : fields_)
    size +=
        2 * number + name.size() + static_cast<std::uint64_t>(field.components()) * points_.stride_of_all_ranks() * sizeof(double);
  return size;
}

void State::write_numbers(ByteWriter& out) const {
  out.value(time);
  out.value(step);
  out.value(energies);
  out.value(static_cast<std::uint64_t>(numbers_.size()));
  for (const auto& [name, values] : numbers_) {
    out.text(name);
    out.numbers(values);
  }
  out.value(static_cast<std::uint64_t>(fields_.size()));
}

void State::write_here(ByteWriter& out) const {
  write_numbers(out);
  for (const auto& [name, field] : fields_) {
    out.text(name);
    out.value(static_cast<std::int64_t>(field.components()));
    out.bytes(field.data(), field.size() * sizeof(double));
  }
}

void State::write(ByteWriter& out) const {
  if (!points_.distributed()) return write_here(out);
  const OwnPlaces own(points_);
  write_numbers(out);
  std::vector<double> values;
  for (const auto& [name, field] : fields_) {
    out.text(name);
    out.value(static_cast<std::int64_t>(field.components()));
    for (int c = 0; c < field.components(); ++c)
      each_piece(points_.stride_of_all_ranks(), [&, &field = field](std::size_t first, std::size_t count) {
        const std::vector<double> piece = gather_piece(own.places, first, count, 1, [&](std::size_t from, std::size_t to) {
          values.clear();
          for (std::size_t n = from; n < to; ++n) values.push_back(field.component(c)[own.points[n]]);
          return std::span<const double>(values);
        });
        out.bytes(piece.data(), piece.size() * sizeof(double));
      });
  }
}

void State::read_numbers(ByteReader& in) {
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
}

/// The field whose values come next.
FieldView State::declared_like(ByteReader& in) {
  const std::string name = in.text();
  const auto components = in.value<std::int64_t>();
  if (components < 1 || components > 1024) throw InputError("the saved state is damaged");
  const FieldView field = declare(name, static_cast<int>(components));
  if (field.components != components) throw InputError("the saved state is damaged");
  return field;
}

void State::read_here(ByteReader& in) {
  read_numbers(in);
  for (auto left = in.value<std::uint64_t>(); left > 0; --left) {
    const FieldView field = declared_like(in);
    in.bytes(field.data, field.size() * sizeof(double));
  }
}

void State::read(ByteReader& in) {
  if (!points_.distributed()) return read_here(in);
  const OwnPlaces own(points_);
  read_numbers(in);
  std::vector<double> values;
  for (auto left = in.value<std::uint64_t>(); left > 0; --left) {
    const FieldView field = declared_like(in);
    for (int c = 0; c < field.components; ++c) {
      std::size_t next = 0;
      each_piece(points_.stride_of_all_ranks(), [&](std::size_t first, std::size_t count) {
        values.resize(count);
        in.bytes(values.data(), count * sizeof(double));
        for (; next < own.points.size() && own.places[next] < static_cast<std::int64_t>(first + count); ++next)
          field.component(c)[own.points[next]] = values[static_cast<std::size_t>(own.places[next]) - first];
      });
    }
  }
}

}  // namespace perikit
