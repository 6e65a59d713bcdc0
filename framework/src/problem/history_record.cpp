#include "problem/history_record.hpp"

#include <algorithm>
#include <numeric>

#include "perikit/core/errors.hpp"
#include "perikit/core/rank_values.hpp"

namespace perikit {

HistoryRecord HistoryRecord::of(const Terms& terms) {
  HistoryRecord record;
  const LawHistory* const history = terms.history();
  if (!history) return record;
  const std::size_t width = history->components();
  std::vector<HistoryPoint> points;
  std::vector<double> values;
  for (const HistoryPlace& place : terms.history_points()) {
    if (!place.own) continue;
    points.push_back(place.point);
    for (std::size_t c = 0; c < width; ++c) values.push_back(history->begin()[c * history->stride() + static_cast<std::size_t>(place.number)]);
  }
  record.components = width;
  if (communicator().size() == 1) {
    record.points = std::move(points);
    record.values = std::move(values);
    return record;
  }
  points = gathered<HistoryPoint>(points);
  values = gathered<double>(values);
  std::vector<std::size_t> order(points.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, {}, [&](std::size_t k) { return points[k]; });
  for (const std::size_t k : order) {
    record.points.push_back(points[k]);
    record.values.insert(record.values.end(), values.begin() + static_cast<std::ptrdiff_t>(k * width), values.begin() + static_cast<std::ptrdiff_t>((k + 1) * width));
  }
  return record;
}

void HistoryRecord::restore(Terms& terms) const {
  LawHistory* const history = terms.history();
  const char* const other = "the saved state belongs to other materials";
  if (components != (history ? history->components() : 0)) throw InputError(other);
  if (!history) return;
  const std::span<double> all = history->values();
  std::ranges::fill(all, 0.0);
  for (const HistoryPlace& place : terms.history_points()) {
    const auto found = std::ranges::lower_bound(points, place.point);
    if (found == points.end() || *found != place.point) throw InputError(other);
    const auto row = static_cast<std::size_t>(found - points.begin());
    for (std::size_t c = 0; c < components; ++c) all[c * history->stride() + static_cast<std::size_t>(place.number)] = values[row * components + c];
  }
  terms.history_restored();
}

void HistoryRecord::write(ByteWriter& out) const {
  out.value(static_cast<std::uint64_t>(components));
  out.value(static_cast<std::uint64_t>(points.size()));
  out.bytes(points.data(), points.size() * sizeof(HistoryPoint));
  out.bytes(values.data(), values.size() * sizeof(double));
}

HistoryRecord HistoryRecord::read(ByteReader& in) {
  HistoryRecord record;
  record.components = in.value<std::uint64_t>();
  const auto count = in.value<std::uint64_t>();
  in.expect(record.components, 1);
  in.expect(count, sizeof(HistoryPoint) + record.components * sizeof(double));
  record.points.resize(count);
  record.values.resize(count * record.components);
  in.bytes(record.points.data(), count * sizeof(HistoryPoint));
  in.bytes(record.values.data(), record.values.size() * sizeof(double));
  return record;
}

}  // namespace perikit
