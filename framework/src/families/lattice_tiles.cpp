#include "families/lattice_tiles.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>

#include "families/lattice_slots.hpp"
#include "families/quiet_blocks.hpp"

namespace perikit {

LatticeTiles::LatticeTiles(const Body& body, const LatticeSlots& slots) {
  // Tiles of rows times segments along the rows, small enough for the second-level cache and to share out among threads.
  constexpr std::int64_t segment = 32;   // chunks
  const Lattice& lattice = *body.lattice();
  const auto& n = lattice.extent;
  const std::int64_t row_chunks = (n[0] + chunk_points - 1) / chunk_points, segments = (row_chunks + segment - 1) / segment;
  const std::int64_t points = n[0] * n[1] * n[2];
  std::int64_t tile1 = 16, tile2 = 8;
  while (points / (tile1 * tile2 * std::min<std::int64_t>(n[0], segment * chunk_points)) < 16 && tile1 * tile2 > 1) {
    (tile1 > tile2 ? tile1 : tile2) /= 2;
  }
  const std::int64_t length = segments > 1 || n[1] * n[2] > 8 ? segment : std::max<std::int64_t>(1, row_chunks / 16);
  const std::int64_t reach_chunks = (slots.row_reach + chunk_points - 1) / chunk_points;
  std::vector<Box> boxes;
  const auto alive = body.alive_bits();
  for (std::int64_t b2 = 0; b2 < n[2]; b2 += tile2)
    for (std::int64_t b1 = 0; b1 < n[1]; b1 += tile1)
      for (std::int64_t b0 = 0; b0 < row_chunks; b0 += length) {
        LatticeBlock block{chunks.size(), 0, rows.size(), 0};
        const Box box{{b0, b1, b2}, {std::min(b0 + length, row_chunks) - 1, std::min(b1 + tile1, n[1]) - 1, std::min(b2 + tile2, n[2]) - 1}};
        for (std::int64_t k2 = b2; k2 <= box.high[2]; ++k2)
          for (std::int64_t k1 = b1; k1 <= box.high[1]; ++k1) {
            const std::int64_t first = lattice.index(b0 * chunk_points, k1, k2);
            rows.push_back({static_cast<std::int32_t>(first), static_cast<std::int32_t>(box.high[0] - b0 + 1), static_cast<std::int32_t>(k1), static_cast<std::int32_t>(k2),
                            static_cast<std::int32_t>(std::min(reach_chunks, b0)), static_cast<std::int32_t>(std::min(reach_chunks, row_chunks - 1 - box.high[0]))});
            for (std::int64_t c = 0; c <= box.high[0] - b0; ++c) {
              const std::int64_t index = first + c * chunk_points;
              if (alive[static_cast<std::size_t>(index / chunk_points)]) chunks.push_back({static_cast<std::int32_t>(index), -1});
            }
          }
        block.chunk_end = chunks.size();
        block.row_end = rows.size();
        blocks.push_back(block);
        boxes.push_back(box);
      }
  colour(boxes, {length, tile1, tile2}, {(row_chunks + length - 1) / length, (n[1] + tile1 - 1) / tile1, (n[2] + tile2 - 1) / tile2}, slots);
  chunk_at_.assign(body.stride() / chunk_points, -1);
  for (std::size_t c = 0; c < chunks.size(); ++c) chunk_at_[static_cast<std::size_t>(chunks[c].first) / chunk_points] = static_cast<std::int32_t>(c);
  for (const LatticeRow& row : rows)
    for (int c = 0; c < row.chunks; ++c) {
      const std::int32_t at = row.first + c * chunk_points;
      const std::uint8_t live = alive[static_cast<std::size_t>(at / chunk_points)];
      if (live != 0xff) partly_dead_.emplace_back(at, live);
    }
}

void LatticeTiles::colour(const std::vector<Box>& boxes, const std::int64_t (&size)[3], const std::int64_t (&count)[3], const LatticeSlots& slots) {
  // Units are tiles. A block touches every tile that its box, grown by the reach of a family, meets.
  std::array<std::int64_t, 3> grow{};
  for (const auto& d : slots.offsets)
    for (std::size_t a = 0; a < 3; ++a) grow[a] = std::max<std::int64_t>(grow[a], std::abs(d[a]));
  grow[0] = (grow[0] + chunk_points - 1) / chunk_points;
  const auto tile = [&](std::int64_t e, std::int64_t d, std::int64_t c) { return static_cast<std::int32_t>(e + count[0] * (d + count[1] * c)); };
  reach.units = static_cast<std::size_t>(count[0] * count[1] * count[2]);
  reach.touches.resize(boxes.size());
  for (std::size_t b = 0; b < boxes.size(); ++b) {
    std::int64_t low[3], high[3];
    for (int a = 0; a < 3; ++a) {
      low[a] = std::max<std::int64_t>(0, boxes[b].low[a] - grow[a]) / size[a];
      high[a] = std::min(count[a] - 1, (boxes[b].high[a] + grow[a]) / size[a]);
    }
    for (std::int64_t c = low[2]; c <= high[2]; ++c)
      for (std::int64_t d = low[1]; d <= high[1]; ++d)
        for (std::int64_t e = low[0]; e <= high[0]; ++e) reach.touches[b].push_back(tile(e, d, c));
    reach.own.push_back(tile(boxes[b].low[0] / size[0], boxes[b].low[1] / size[1], boxes[b].low[2] / size[2]));
  }
  colouring = Colouring(reach);
}

bool LatticeTiles::moves(std::size_t b, ConstFieldView u) const noexcept {
  return std::any_of(rows.begin() + static_cast<std::ptrdiff_t>(blocks[b].row_begin), rows.begin() + static_cast<std::ptrdiff_t>(blocks[b].row_end),
                     [&](const LatticeRow& row) {
                       const auto first = static_cast<std::size_t>(row.first);
                       return QuietBlocks::moves(u, first, first + static_cast<std::size_t>(row.chunks) * chunk_points);
                     });
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
  return chunks.size() * sizeof(LatticeChunk) + rows.size() * sizeof(LatticeRow) + blocks.size() * sizeof(LatticeBlock) +
         chunk_at_.size() * sizeof(std::int32_t) + partly_dead_.size() * sizeof(partly_dead_[0]);
}

}  // namespace perikit
