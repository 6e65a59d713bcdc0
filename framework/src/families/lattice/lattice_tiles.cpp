#include "families/lattice/lattice_tiles.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "families/lattice/lattice_slots.hpp"
#include "families/resting_blocks.hpp"
#include "perikit/core/point_motion.hpp"

namespace perikit {

LatticeTiles::LatticeTiles(const Body& body, const LatticeSlots& slots) {
  const Lattice& lattice = *body.lattice();
  const LatticeTiling tiling(lattice);
  const auto& n = lattice.extent;
  const std::int64_t row_chunks = (n[0] + chunk_points - 1) / chunk_points, first_chunk = lattice.first[0] / chunk_points;
  const std::int64_t reach_chunks = (slots.row_reach + chunk_points - 1) / chunk_points;
  const auto from = tiling.of(lattice.first),
             to = tiling.of({lattice.first[0] + n[0] - 1, lattice.first[1] + n[1] - 1, lattice.first[2] + n[2] - 1});
  const auto alive = body.alive_bits();
  std::vector<std::int32_t> tiles;  // by block
  for (std::int64_t t2 = from[2]; t2 <= to[2]; ++t2)
    for (std::int64_t t1 = from[1]; t1 <= to[1]; ++t1)
      for (std::int64_t t0 = from[0]; t0 <= to[0]; ++t0) {
        // What the box holds of the tile: chunks along the row, then rows.
        const auto low = [&](std::size_t a, std::int64_t tile, std::int64_t first) {
          return std::max<std::int64_t>(0, tile * tiling.size[a] - first);
        };
        const auto high = [&](std::size_t a, std::int64_t tile, std::int64_t first, std::int64_t size) {
          return std::min(size, (tile + 1) * tiling.size[a] - first) - 1;
        };
        const std::int64_t b0 = low(0, t0, first_chunk), e0 = high(0, t0, first_chunk, row_chunks);
        LatticeBlock block{chunks.size(), 0, rows.size(), 0};
        for (std::int64_t k2 = low(2, t2, lattice.first[2]); k2 <= high(2, t2, lattice.first[2], n[2]); ++k2)
          for (std::int64_t k1 = low(1, t1, lattice.first[1]); k1 <= high(1, t1, lattice.first[1], n[1]); ++k1) {
            const std::int64_t first = lattice.index(b0 * chunk_points, k1, k2);
            rows.push_back({static_cast<std::int32_t>(first), static_cast<std::int32_t>(e0 - b0 + 1),
                            static_cast<std::int32_t>(k1), static_cast<std::int32_t>(k2),
                            static_cast<std::int32_t>(std::min(reach_chunks, b0)),
                            static_cast<std::int32_t>(std::min(reach_chunks, row_chunks - 1 - e0))});
            for (std::int64_t c = 0; c <= e0 - b0; ++c) {
              const std::int64_t index = first + c * chunk_points;
              if (alive[static_cast<std::size_t>(index / chunk_points)]) chunks.push_back({static_cast<std::int32_t>(index), -1});
            }
          }
        block.chunk_end = chunks.size();
        block.row_end = rows.size();
        blocks.push_back(block);
        tiles.push_back(static_cast<std::int32_t>(tiling.number({t0, t1, t2})));
      }
  colour(tiling, tiles, body, slots);
  if (body.part()) {
    complete_rows.assign(static_cast<std::size_t>(n[1] * n[2]), 0);
    for (const std::int32_t p : body.complete()) {
      const auto cell = lattice.cell(p);
      complete_rows[static_cast<std::size_t>(cell[1] + cell[2] * n[1])] = 1;
    }
  }
  chunk_at_.assign(body.stride() / chunk_points, -1);
  for (std::size_t c = 0; c < chunks.size(); ++c)
    chunk_at_[static_cast<std::size_t>(chunks[c].first) / chunk_points] = static_cast<std::int32_t>(c);
  for (const LatticeRow& row : rows)
    for (int c = 0; c < row.chunks; ++c) {
      const std::int32_t at = row.first + c * chunk_points;
      const std::uint8_t live = alive[static_cast<std::size_t>(at / chunk_points)];
      if (live != 0xff) partly_dead_.emplace_back(at, live);
    }
}

/// Units are tiles of the whole lattice, so that its blocks have the same colours in every box of it. A block touches every tile
/// that its own, grown by the reach of a family, meets.
void LatticeTiles::colour(const LatticeTiling& tiling, const std::vector<std::int32_t>& tiles, const Body& body,
                          const LatticeSlots& slots) {
  const Lattice& lattice = *body.lattice();
  std::array<std::int64_t, 3> grow{};
  for (const auto& d : slots.offsets)
    for (std::size_t a = 0; a < 3; ++a) grow[a] = std::max<std::int64_t>(grow[a], std::abs(d[a]));
  grow[0] = (grow[0] + chunk_points - 1) / chunk_points;
  const std::array<std::int64_t, 3> cells{(lattice.whole[0] + chunk_points - 1) / chunk_points, lattice.whole[1],
                                          lattice.whole[2]};
  const auto& [size, count] = tiling;
  std::vector<std::vector<std::int32_t>> touches;
  for (std::int64_t t2 = 0; t2 < count[2]; ++t2)
    for (std::int64_t t1 = 0; t1 < count[1]; ++t1)
      for (std::int64_t t0 = 0; t0 < count[0]; ++t0) {
        const std::array<std::int64_t, 3> tile{t0, t1, t2};
        std::array<std::int64_t, 3> low, high;
        for (std::size_t a = 0; a < 3; ++a) {
          low[a] = std::max<std::int64_t>(0, tile[a] * size[a] - grow[a]) / size[a];
          high[a] = std::min(count[a] - 1, (std::min((tile[a] + 1) * size[a], cells[a]) - 1 + grow[a]) / size[a]);
        }
        auto& touched = touches.emplace_back();
        for (std::int64_t c = low[2]; c <= high[2]; ++c)
          for (std::int64_t d = low[1]; d <= high[1]; ++d)
            for (std::int64_t e = low[0]; e <= high[0]; ++e)
              touched.push_back(static_cast<std::int32_t>(tiling.number({e, d, c})));
      }
  const TileColours colours(tiling, slots.offsets);
  std::vector<std::int32_t> of_blocks;
  reach.units = static_cast<std::size_t>(tiling.tiles());
  for (const std::int32_t tile : tiles) {
    of_blocks.push_back(colours.of(tile));
    reach.own.push_back(tile);
    reach.touches.push_back(std::move(touches[static_cast<std::size_t>(tile)]));
  }
  const std::vector<std::uint8_t> arriving = arriving_points(body);
  if (!arriving.empty()) reach.elsewhere.assign(reach.units, 0);
  for (std::size_t b = 0; b < blocks.size() && !arriving.empty(); ++b)
    for (std::size_t c = blocks[b].chunk_begin; c < blocks[b].chunk_end; ++c)
      for (auto p = static_cast<std::size_t>(chunks[c].first), end = p + chunk_points; p < end; ++p)
        if (arriving[p]) reach.elsewhere[static_cast<std::size_t>(tiles[b])] = 1;
  sequence = BlockSequence(reach);
  // Cells of the colouring: groups of eight along rows; whole rows where a tile is as long.
  const std::int64_t along = count[0] > 1 ? (lattice.extent[0] + chunk_points - 1) / chunk_points : 1;
  const auto all_rows = static_cast<std::size_t>(lattice.extent[1] * lattice.extent[2]);
  std::vector<std::size_t> found(all_rows);  // one more than the block that has listed a row last
  std::vector<std::vector<std::int32_t>> cells_of(blocks.size());
  for (std::size_t b = 0; b < blocks.size(); ++b)
    for (std::size_t r = blocks[b].row_begin; r < blocks[b].row_end; ++r) {
      const LatticeRow& row = rows[r];
      const std::int64_t chunk = row.first / chunk_points - lattice.index(0, row.k1, row.k2) / chunk_points;
      const std::int64_t first = along == 1 ? 0 : std::max<std::int64_t>(0, chunk - grow[0]),
                         last = along == 1 ? 0 : std::min(along - 1, chunk + row.chunks - 1 + grow[0]);
      const auto reach_row = [&](std::int64_t k1, std::int64_t k2) {
        if (k1 < 0 || k1 >= lattice.extent[1] || k2 < 0 || k2 >= lattice.extent[2]) return;
        const std::int64_t to = k1 + lattice.extent[1] * k2;
        if (std::exchange(found[static_cast<std::size_t>(to)], b + 1) == b + 1) return;
        for (std::int64_t k0 = first; k0 <= last; ++k0) cells_of[b].push_back(static_cast<std::int32_t>(k0 + along * to));
      };
      reach_row(row.k1, row.k2);
      for (const RowPair& pair : slots.row_pairs) {
        reach_row(row.k1 - pair.d1, row.k2 - pair.d2);
        reach_row(row.k1 + pair.d1, row.k2 + pair.d2);
      }
    }
  colouring = Colouring(reach, of_blocks, static_cast<std::size_t>(along) * all_rows,
                        [&](std::size_t b, std::vector<std::int32_t>& touched) { touched = cells_of[b]; });
  // Gradients of cells beyond the ends of a piece of a row are computed with it, and reach as far once more.
  const std::int64_t beyond = chunk_points * grow[0], row_size = along == 1 ? lattice.extent[0] : chunk_points;
  std::vector<std::size_t> listed(body.stride() / PointMotion::piece_points + 1);  // one more than the block that has listed a piece last
  pieces_.resize(blocks.size());
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    for (const std::int32_t cell : cells_of[b]) {
      const std::int64_t row = cell / along, from = lattice.index(0, row % lattice.extent[1], row / lattice.extent[1]),
                         first = from + chunk_points * (cell % along);
      const auto begin = static_cast<std::size_t>(std::max(from, first - beyond)),
                 end = static_cast<std::size_t>(std::min(from + lattice.extent[0], first + row_size + beyond));
      for (std::size_t i = begin / PointMotion::piece_points; i <= (end - 1) / PointMotion::piece_points; ++i)
        if (std::exchange(listed[i], b + 1) != b + 1) pieces_[b].push_back(static_cast<std::int32_t>(i));
    }
    std::ranges::sort(pieces_[b]);
  }
}

bool LatticeTiles::moves(std::size_t b, ConstFieldView u) const noexcept {
  return std::any_of(rows.begin() + static_cast<std::ptrdiff_t>(blocks[b].row_begin),
                     rows.begin() + static_cast<std::ptrdiff_t>(blocks[b].row_end), [&](const LatticeRow& row) {
                       const auto first = static_cast<std::size_t>(row.first);
                       return RestingBlocks::moves(u, first, first + static_cast<std::size_t>(row.chunks) * chunk_points);
                     });
}

void LatticeTiles::complete(GroupMarks& marks) const {
  for (std::size_t b = 0; b < blocks.size(); ++b)
    for (std::size_t c = blocks[b].chunk_begin; c < blocks[b].chunk_end && marked(b, marks.data()); ++c)
      marks[static_cast<std::size_t>(chunks[c].first / chunk_points)] = whole_group;
}

void LatticeTiles::clear(std::size_t b, FieldView out) const noexcept {
  for (std::size_t r = blocks[b].row_begin; r < blocks[b].row_end; ++r)
    for (int c = 0; c < out.components; ++c)
      std::memset(out.component(c) + rows[r].first, 0, sizeof(double) * static_cast<std::size_t>(rows[r].chunks) * chunk_points);
}

void LatticeTiles::clear_dead(FieldView out) const noexcept {
  for (const auto& [first, live] : partly_dead_)
    for (int c = 0; c < out.components; ++c)
      for (int l = 0; l < chunk_points; ++l)
        if (!(live >> l & 1)) out.component(c)[first + l] = 0.0;
}

std::size_t LatticeTiles::bytes() const noexcept {
  std::size_t pieces = 0;
  for (const std::vector<std::int32_t>& of_block : pieces_) pieces += of_block.size();
  return pieces * sizeof(std::int32_t) + chunks.size() * sizeof(LatticeChunk) + rows.size() * sizeof(LatticeRow) + blocks.size() * sizeof(LatticeBlock) +
         chunk_at_.size() * sizeof(std::int32_t) + complete_rows.size() + partly_dead_.size() * sizeof(partly_dead_[0]);
}

}  // namespace perikit
