#include "families/cloud/cloud_rows.hpp"

#include <algorithm>
#include <utility>

#include "body/partition/block_colours.hpp"
#include "core/each_once.hpp"
#include "families/resting_blocks.hpp"

namespace perikit {

namespace {

Row mirrored(ConstFieldView u, const double* fourth, std::size_t p) noexcept {
  Row row{};
  for (int c = 0; c < u.components; ++c) row[c] = u.component(c)[p];
  if (fourth) row[3] = fourth[p];
  return row;
}

}  // namespace

void mirror_rows(ConstFieldView u, std::size_t points, AlignedVector<Row>& rows, const double* fourth) {
  rows.resize(points);
  pieces_of(points).over_points([&](std::size_t p) { rows[p] = mirrored(u, fourth, p); });
}

ArrivingPieces::ArrivingPieces(const Body& body) : size_(body.stride()) {
  const std::vector<std::uint8_t> arriving = arriving_points(body);
  const CloudBlocks blocks = pieces_of(size_);
  for (std::size_t b = 0; b < blocks.count(); ++b)
    for (std::size_t begin = blocks.begin(b), end = begin; begin < blocks.end(b); begin = end) {
      const auto same = [&](std::size_t p) { return arriving.empty() || arriving[p] == arriving[begin]; };
      while (end < blocks.end(b) && same(end)) ++end;
      pieces_.push_back({static_cast<std::int32_t>(begin), static_cast<std::int32_t>(end)});
    }
  const auto late = std::stable_partition(pieces_.begin(), pieces_.end(), [&](const Piece& piece) {
    return arriving.empty() || arriving[static_cast<std::size_t>(piece.begin)] == 0;
  });
  here_ = static_cast<std::size_t>(late - pieces_.begin());
}

ArrivingRows::ArrivingRows(const ArrivingPieces& pieces, ConstFieldView u, AlignedVector<Row>& rows, Arrival* first, const double* fourth)
    : DependentArrival(first), pieces_(pieces), u_(u), rows_(rows), fourth_(fourth) {
  rows.resize(pieces.size());
  const std::span<const ArrivingPieces::Piece> known = pending() ? pieces.here() : pieces.all();
  parallel_for(known.size(), [&](std::size_t k) { mirror(known[k]); });
}

void ArrivingRows::put() {
  for (const ArrivingPieces::Piece& piece : pieces_.arriving()) mirror(piece);
}

void ArrivingRows::mirror(const ArrivingPieces::Piece& piece) noexcept {
  for (auto p = static_cast<std::size_t>(piece.begin); p < static_cast<std::size_t>(piece.end); ++p) rows_[p] = mirrored(u_, fourth_, p);
}

BlockReach cloud_reach(const FamilyLists& families, const CloudBlocks& blocks) {
  BlockReach reach;
  reach.units = blocks.count();
  reach.touches.resize(reach.units);
  for (std::size_t b = 0; b < reach.units; ++b) {
    reach.own.push_back(static_cast<std::int32_t>(b));
    std::vector<std::int32_t>& units = reach.touches[b];
    units.push_back(static_cast<std::int32_t>(b));
    for (std::size_t p = blocks.begin(b); p < blocks.end(b); ++p) {
      for (std::int64_t k = families.first[p]; k < families.first[p + 1]; ++k) {
        const auto unit =
            static_cast<std::int32_t>(blocks.of(static_cast<std::size_t>(families.neighbour[static_cast<std::size_t>(k)])));
        if (unit != units.back()) units.push_back(unit);
      }
    }
    keep_each_once(units);
  }
  return reach;
}

BlockReach cloud_reach(const Body& body, const FamilyLists& families) {
  const CloudBlocks blocks(body);
  BlockReach reach = cloud_reach(families, blocks);
  const std::vector<std::uint8_t> arriving = arriving_points(body);
  if (!arriving.empty()) reach.elsewhere.assign(reach.units, 0);
  for (std::size_t p = 0; p < body.points() && !arriving.empty(); ++p)
    if (arriving[p]) reach.elsewhere[blocks.of(p)] = 1;
  return reach;
}

Colouring cloud_colouring(const Body& body, const FamilyLists& families, const CloudBlocks& blocks, const BlockReach& reach) {
  const std::size_t points = families.first.size() - 1, units = (points + colour_unit - 1) / colour_unit;
  std::vector<std::size_t> found(units);  // one more than the block that has listed a unit last
  std::vector<std::vector<std::int32_t>> touches(blocks.count());
  for (std::size_t b = 0; b < blocks.count(); ++b) {
    const auto add = [&](std::size_t point) {
      const std::size_t unit = point / colour_unit;
      if (std::exchange(found[unit], b + 1) != b + 1) touches[b].push_back(static_cast<std::int32_t>(unit));
    };
    for (std::size_t p = blocks.begin(b); p < blocks.end(b); ++p) {
      add(p);
      for (std::int64_t k = families.first[p]; k < families.first[p + 1]; ++k)
        add(static_cast<std::size_t>(families.neighbour[static_cast<std::size_t>(k)]));
    }
  }
  std::vector<std::int32_t> colours = body.block_colours();
  if (colours.empty()) {
    FreeColours free(units);
    for (const std::vector<std::int32_t>& touched : touches) colours.push_back(free.next(std::span(touched)));
  }
  return Colouring(reach, colours, units, [&](std::size_t b, std::vector<std::int32_t>& touched) { touched = touches[b]; });
}

bool CloudBlocks::moves(ConstFieldView u, std::size_t b) const noexcept { return RestingBlocks::moves(u, begin(b), end(b)); }

}  // namespace perikit
