#include "families/cloud_rows.hpp"

#include <algorithm>
#include <utility>

#include "families/quiet_blocks.hpp"

namespace perikit {

void mirror_rows(ConstFieldView u, std::size_t points, AlignedVector<Row>& rows, const double* fourth) {
  rows.resize(points);
  pieces_of(points).over_points([&](std::size_t p) {
    Row row{};
    for (int c = 0; c < u.components; ++c) row[c] = u.component(c)[p];
    if (fourth) row[3] = fourth[p];
    rows[p] = row;
  });
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
    std::sort(units.begin(), units.end());
    units.erase(std::unique(units.begin(), units.end()), units.end());
  }
  return reach;
}

Colouring cloud_colouring(const Body& body, const FamilyLists& families, const CloudBlocks& blocks, const BlockReach& reach) {
  const std::size_t points = families.first.size() - 1, groups = padded(points) / padding;
  std::vector<std::size_t> found(groups);  // one more than the block that has listed a group last
  const auto touch = [&](std::size_t b, std::vector<std::int32_t>& touched) {
    const auto add = [&](std::size_t point) {
      const std::size_t group = point / padding;
      if (std::exchange(found[group], b + 1) != b + 1) touched.push_back(static_cast<std::int32_t>(group));
    };
    for (std::size_t p = blocks.begin(b); p < blocks.end(b); ++p) {
      add(p);
      for (std::int64_t k = families.first[p]; k < families.first[p + 1]; ++k)
        add(static_cast<std::size_t>(families.neighbour[static_cast<std::size_t>(k)]));
    }
  };
  return Colouring(reach, body.block_colours().empty() ? free_colours(reach) : body.block_colours(), groups, touch);
}

bool CloudBlocks::moves(ConstFieldView u, std::size_t b) const noexcept { return QuietBlocks::moves(u, begin(b), end(b)); }

}  // namespace perikit
