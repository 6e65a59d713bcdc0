#include "problem/saved/history_record.hpp"

#include <algorithm>

#include "core/ranks/merged_rows.hpp"
#include "perikit/core/errors.hpp"

namespace perikit {

namespace {
[[noreturn]] void refuse() { throw InputError("the saved state belongs to other materials"); }
}  // namespace

HistoryRecord::HistoryRecord(const Terms& terms) : history_(terms.material_points()), components_(history_ ? history_->components() : 0) {
  for (const HistoryPlace& place : terms.history_points()) {
    if (!place.own) continue;
    points_.push_back(place.point);
    numbers_.push_back(place.number);
  }
  points_of_all_ = static_cast<std::uint64_t>(counted(std::ssize(points_)).all);
}

std::uint64_t HistoryRecord::written() const {
  return sizeof(std::uint64_t) + sizeof points_of_all_ + points_of_all_ * (sizeof(HistoryPoint) + components_ * sizeof(double));
}

void HistoryRecord::write(ByteWriter& out) const {
  out.value(static_cast<std::uint64_t>(components_));
  out.value(points_of_all_);
  const std::span<const HistoryPoint> points = points_;
  over_merged(points, [&](std::span<const HistoryPoint> piece) { out.bytes(piece.data(), piece.size_bytes()); });
  if (components_ == 0) return;
  std::vector<double> values;
  const auto values_of = [&](std::size_t from, std::size_t to) {
    values.clear();
    for (std::size_t k = from; k < to; ++k)
      for (std::size_t c = 0; c < components_; ++c)
        values.push_back(history_->begin()[c * history_->stride() + static_cast<std::size_t>(numbers_[k])]);
    return std::span<const double>(values);
  };
  over_merged_rows(points, components_, values_of, [&](std::span<const HistoryPoint>, std::span<const double> rows) {
    out.bytes(rows.data(), rows.size_bytes());
  });
}

void HistoryRecord::read(ByteReader& in, Terms& terms) {
  MaterialPoints* const of_laws = terms.material_points();
  const auto components = in.value<std::uint64_t>(), count = in.value<std::uint64_t>();
  if (components != (of_laws ? of_laws->components() : 0)) refuse();
  in.expect(count, sizeof(HistoryPoint) + components * sizeof(double));
  const std::vector<HistoryPlace> places = terms.history_points();
  std::vector<std::uint64_t> rows;  // of these in the record; both ascend
  for (std::uint64_t row = 0; row < count; ++row)
    for (const auto point = in.value<HistoryPoint>(); rows.size() < places.size() && places[rows.size()].point == point;)
      rows.push_back(row);
  if (rows.size() < places.size()) refuse();
  if (!of_laws) return;
  const std::span<double> all = of_laws->values();
  std::ranges::fill(all, 0.0);
  std::vector<double> values(components);
  std::size_t next = 0;
  for (std::uint64_t row = 0; row < count; ++row) {
    in.bytes(values.data(), components * sizeof(double));
    for (; next < rows.size() && rows[next] == row; ++next)
      for (std::size_t c = 0; c < components; ++c)
        all[c * of_laws->stride() + static_cast<std::size_t>(places[next].number)] = values[c];
  }
  terms.history_restored();
}

std::size_t HistoryRecord::count(ByteReader& in) {
  const auto components = in.value<std::uint64_t>(), points = in.value<std::uint64_t>();
  in.expect(components, 1);
  in.expect(points, sizeof(HistoryPoint) + components * sizeof(double));
  return points * components;
}

void HistoryRecord::write_here(const Terms& terms, ByteWriter& out) {
  const MaterialPoints* const of_laws = terms.material_points();
  out.numbers(of_laws ? of_laws->values() : std::span<const double>());
}

void HistoryRecord::read_here(ByteReader& in, Terms& terms) {
  MaterialPoints* const of_laws = terms.material_points();
  const std::span<double> values = of_laws ? of_laws->values() : std::span<double>();
  if (in.value<std::uint64_t>() != values.size()) refuse();
  in.bytes(values.data(), values.size_bytes());
  if (of_laws) terms.history_restored();
}

}  // namespace perikit
