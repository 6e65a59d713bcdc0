#include "perikit/problem/first_rank.hpp"

#include <algorithm>
#include <cstring>

#include "perikit/core/rank_values.hpp"

namespace perikit {

namespace {

/// The values at these points, component by component.
void pack(ConstFieldView field, std::span<const std::int32_t> points, std::vector<double>& values) {
  values.clear();
  for (int c = 0; c < field.components; ++c)
    for (const std::int32_t p : points) values.push_back(field.component(c)[p]);
}

void unpack(std::span<const double> values, std::span<const std::int32_t> points, FieldView field) {
  for (int c = 0; c < field.components; ++c)
    for (std::size_t k = 0; k < points.size(); ++k)
      field.component(c)[points[k]] = values[static_cast<std::size_t>(c) * points.size() + k];
}

}  // namespace

FirstRank::FirstRank(const Points& all, std::span<const std::int32_t> points) : all_(all), points_(points.begin(), points.end()) {
  std::vector<std::int32_t> mine;
  for (const std::int32_t p : points_)
    mine.push_back(static_cast<std::int32_t>(all.places().place[static_cast<std::size_t>(p)]));
  for (const std::vector<std::byte>& of_rank : communicator().gather(std::as_bytes(std::span(mine)))) {
    std::vector<std::int32_t>& places = places_.emplace_back(of_rank.size() / sizeof(std::int32_t));
    if (!of_rank.empty()) std::memcpy(places.data(), of_rank.data(), of_rank.size());
  }
}

Field FirstRank::gather(ConstFieldView mine) const {
  std::vector<std::vector<double>> values(std::max<std::size_t>(1, places_.size()));
  pack(mine, points_, values.front());
  if (places_.empty()) {
    const Message to_first{0, values.front(), {}};
    communicator().exchange({&to_first, 1});
    return {};
  }
  std::vector<Message> messages;
  for (std::size_t rank = 1; rank < places_.size(); ++rank) {
    values[rank].resize(places_[rank].size() * static_cast<std::size_t>(mine.components));
    messages.push_back({static_cast<int>(rank), {}, values[rank]});
  }
  communicator().exchange(messages);
  Field whole(mine.components, all_.places().stride);
  for (std::size_t rank = 0; rank < places_.size(); ++rank) unpack(values[rank], places_[rank], whole);
  return whole;
}

void FirstRank::scatter(ConstFieldView whole, FieldView mine) const {
  std::fill_n(mine.data, mine.size(), 0.0);
  std::vector<std::vector<double>> values(std::max<std::size_t>(1, places_.size()));
  if (places_.empty()) {
    values.front().resize(points_.size() * static_cast<std::size_t>(mine.components));
    const Message from_first{0, {}, values.front()};
    communicator().exchange({&from_first, 1});
  } else {
    std::vector<Message> messages;
    for (std::size_t rank = 0; rank < places_.size(); ++rank) {
      pack(whole, places_[rank], values[rank]);
      if (rank > 0) messages.push_back({static_cast<int>(rank), values[rank], {}});
    }
    communicator().exchange(messages);
  }
  unpack(values.front(), points_, mine);
}

BlockMatrix FirstRank::gather(const BlockMatrix& mine) const {
  const std::size_t size = static_cast<std::size_t>(mine.dimension * mine.dimension);
  const auto place = [&](std::int32_t p) {
    return static_cast<std::int32_t>(all_.places().place[static_cast<std::size_t>(p)]);
  };
  // Of each own row: its place, how many blocks it has, and the places of their columns.
  std::vector<std::int32_t> rows;
  std::vector<double> blocks;
  std::vector<std::uint8_t> own(all_.stride(), 0);
  for (const std::int32_t p : all_.owned()) own[static_cast<std::size_t>(p)] = 1;
  for (std::size_t r = 0; r < mine.rows(); ++r) {
    if (!own[static_cast<std::size_t>(mine.point[r])]) continue;
    const std::int64_t begin = mine.row_first[r], end = mine.row_first[r + 1];
    rows.push_back(place(mine.point[r]));
    rows.push_back(static_cast<std::int32_t>(end - begin));
    for (std::int64_t b = begin; b < end; ++b)
      rows.push_back(place(mine.point[static_cast<std::size_t>(mine.column[static_cast<std::size_t>(b)])]));
    blocks.insert(blocks.end(), mine.values.begin() + begin * static_cast<std::int64_t>(size), mine.values.begin() + end * static_cast<std::int64_t>(size));
  }
  const std::vector<std::int32_t> all_rows = gathered<std::int32_t>(rows);
  const std::vector<double> all_blocks = gathered<double>(blocks);
  BlockMatrix whole;
  if (places_.empty()) return whole;
  struct Row {
    std::int32_t place, count;
    const std::int32_t* columns;
    const double* blocks;
  };
  std::vector<Row> found;
  const double* block = all_blocks.data();
  for (std::size_t k = 0; k < all_rows.size();) {
    const Row& row = found.emplace_back(Row{all_rows[k], all_rows[k + 1], &all_rows[k + 2], block});
    k += 2 + static_cast<std::size_t>(row.count);
    block += static_cast<std::size_t>(row.count) * size;
  }
  std::ranges::sort(found, {}, &Row::place);
  std::vector<std::int32_t> row_at(all_.places().stride, -1);
  for (const Row& row : found) {
    row_at[static_cast<std::size_t>(row.place)] = static_cast<std::int32_t>(whole.point.size());
    whole.point.push_back(row.place);
  }
  whole.dimension = mine.dimension;
  whole.symmetric = mine.symmetric;
  whole.convex = mine.convex;
  whole.row_first.push_back(0);
  for (const Row& row : found) {
    for (std::int32_t k = 0; k < row.count; ++k) {
      const std::int32_t column = row_at[static_cast<std::size_t>(row.columns[k])];
      if (column < 0) continue;
      whole.column.push_back(column);
      const double* values = row.blocks + static_cast<std::size_t>(k) * size;
      whole.values.insert(whole.values.end(), values, values + size);
    }
    whole.row_first.push_back(static_cast<std::int64_t>(whole.column.size()));
  }
  return whole;
}

}  // namespace perikit
