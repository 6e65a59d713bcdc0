#include "families/lattice_families.hpp"

#include "families/quiet_blocks.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <unordered_map>

#include "spaces/local_stencil.hpp"
#include "families/shape_tensor.hpp"

namespace perikit {

LatticeFamilies::LatticeFamilies(const Body& b, const InfluenceFunction& influence, BondWeight weight, bool whole_rows)
    : body(b), lattice(*b.lattice()), spacing(lattice.spacing), volume(b.uniform_volume()), offsets(family_offsets(lattice, b.horizon())), weight_(weight) {
  half = offsets.size() / 2;
  std::vector<double> r;
  for (const auto& d : offsets) {
    shifts.push_back(lattice.shift(d));
    const double length = std::sqrt(double(d[0]) * d[0] + double(d[1]) * d[1] + double(d[2]) * d[2]) * spacing;
    r.push_back(std::min(1.0, length / body.horizon()));
  }
  omega.resize(r.size());
  influence.evaluate(r, omega);
  // Results never depend on a factor of omega; this one keeps its sums near 1.
  const double top = omega.empty() ? 1.0 : *std::max_element(omega.begin(), omega.end());
  if (top > 0) {
    for (double& w : omega) w /= top;
  }
  collect_rows();
  make_blocks(whole_rows);
  make_patterns();
  shared_ = patterns.size();
}

void LatticeFamilies::collect_rows() {
  std::map<std::pair<int, int>, std::map<int, double>> by_row;
  for (std::size_t s = 0; s < offsets.size(); ++s) by_row[{offsets[s][2], offsets[s][1]}][std::abs(offsets[s][0])] = omega[s];
  std::map<int, int> profile_of;
  for (const auto& [row, weights] : by_row) {
    const int d2 = row.first, d1 = row.second, key = d1 * d1 + d2 * d2;
    RowProfile profile;
    profile.reach = weights.rbegin()->first;
    profile.omega.assign(static_cast<std::size_t>(profile.reach) + 1, 0.0);
    profile.omega_d0 = profile.omega;
    for (const auto& [d0, w] : weights) {
      profile.omega[static_cast<std::size_t>(d0)] = w;
      profile.omega_d0[static_cast<std::size_t>(d0)] = w * d0;
    }
    row_reach = std::max(row_reach, profile.reach);
    const auto [entry, fresh] = profile_of.try_emplace(key, static_cast<int>(profiles.size()));
    if (fresh) profiles.push_back(profile);
    if (key == 0) own_row = entry->second;
    if (d2 > 0 || (d2 == 0 && d1 > 0)) row_pairs.push_back({lattice.shift({0, d1, d2}), d1, d2, profile.reach, entry->second});
  }
  std::stable_sort(row_pairs.begin(), row_pairs.end(), [](const RowPair& a, const RowPair& b) { return a.profile < b.profile; });
}

void LatticeFamilies::make_blocks(bool whole_rows) {
  // Tiles of rows times segments along the rows, small enough for the second-level cache and to share out among threads.
  constexpr std::int64_t segment = 32;   // chunks
  const auto& n = lattice.extent;
  const std::int64_t row_chunks = (n[0] + chunk_points - 1) / chunk_points, segments = whole_rows ? 1 : (row_chunks + segment - 1) / segment;
  const std::int64_t points = n[0] * n[1] * n[2];
  std::int64_t tile1 = 16, tile2 = 8;
  while (points / (tile1 * tile2 * std::min<std::int64_t>(n[0], segment * chunk_points)) < 16 && tile1 * tile2 > 1) {
    (tile1 > tile2 ? tile1 : tile2) /= 2;
  }
  const std::int64_t length = whole_rows ? row_chunks : segments > 1 || n[1] * n[2] > 8 ? segment : std::max<std::int64_t>(1, row_chunks / 16);
  const std::int64_t reach_chunks = (row_reach + chunk_points - 1) / chunk_points;
  struct Box {
    std::int64_t low[3], high[3];   // chunk along the row, then rows
  };
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
  // Units are tiles. A block touches every tile that its box, grown by the reach of a family, meets.
  std::array<std::int64_t, 3> grow{};
  for (const auto& d : offsets)
    for (std::size_t a = 0; a < 3; ++a) grow[a] = std::max<std::int64_t>(grow[a], std::abs(d[a]));
  grow[0] = (grow[0] + chunk_points - 1) / chunk_points;
  const std::int64_t size[3] = {length, tile1, tile2};
  const std::int64_t count[3] = {(row_chunks + length - 1) / length, (n[1] + tile1 - 1) / tile1, (n[2] + tile2 - 1) / tile2};
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
  if (length < row_chunks) index_chunks();
}

void LatticeFamilies::index_chunks() {
  if (!chunk_at_.empty()) return;
  chunk_at_.assign(body.stride() / chunk_points, -1);
  for (std::size_t c = 0; c < chunks.size(); ++c) chunk_at_[static_cast<std::size_t>(chunks[c].first) / chunk_points] = static_cast<std::int32_t>(c);
}

bool LatticeFamilies::moves(std::size_t b, ConstFieldView u) const noexcept {
  return std::any_of(rows.begin() + static_cast<std::ptrdiff_t>(blocks[b].row_begin), rows.begin() + static_cast<std::ptrdiff_t>(blocks[b].row_end),
                     [&](const LatticeRow& row) {
                       const auto first = static_cast<std::size_t>(row.first);
                       return QuietBlocks::moves(u, first, first + static_cast<std::size_t>(row.chunks) * chunk_points);
                     });
}

void LatticeFamilies::finish_pattern(LatticePattern& p, const std::vector<std::uint8_t>& live_mask, bool set_up, unsigned lanes) const {
  const int d = lattice.dimension;
  for (int l = 0; l < chunk_points; ++l) {
    if (!(lanes >> l & 1)) continue;
    double K[6] = {}, whole_shape[6] = {}, moment[3] = {}, live_omega = 0, intact_omega = 0, normaliser = 0, inverse[6] = {}, condition = 0;
    for (std::size_t s = 0; s < offsets.size(); ++s) {
      if (!(live_mask[s] >> l & 1)) continue;
      live_omega += omega[s];
      normaliser += weight_ == BondWeight::kernel ? omega[s] * volume : volume;
      const auto add_shape = [&](double* shape) {
        for (int a = 0; a < d; ++a)
          for (int b = a; b < d; ++b) shape[symmetric_index(d, a, b)] += omega[s] * offsets[s][static_cast<std::size_t>(a)] * offsets[s][static_cast<std::size_t>(b)];
      };
      if (p.irregular >> l & 1) add_shape(whole_shape);
      if (!intact(p, s, l)) continue;
      intact_omega += omega[s];
      for (int a = 0; a < d; ++a) moment[a] += omega[s] * offsets[s][static_cast<std::size_t>(a)];
      add_shape(K);
    }
    const bool regular = invert_shape(d, K, inverse, &condition);
    const bool live = p.live >> l & 1;
    p.singular = static_cast<std::uint8_t>((p.singular & ~(1u << l)) | (live && !regular ? 1u << l : 0u));
    for (int c = 0; c < 6; ++c) p.inverse[c][l] = live ? inverse[c] : 0.0;
    for (int c = 0; c < 3; ++c) p.moment[c][l] = live ? moment[c] : 0.0;
    const double share = live_omega > 0 ? intact_omega / live_omega : 0.0;
    p.damage[l] = live && live_omega > 0 ? 1 - share : 0.0;
    p.weight[l] = live ? volume * share : 0.0;
    p.scale[l] = live && normaliser > 0 ? volume / normaliser : 0.0;
    p.condition[l] = live ? condition : 0.0;
    if (set_up) p.intact[l] = intact_omega;
    p.left[l] = p.intact[l] > 0 ? intact_omega / p.intact[l] : 1.0;
    p.support[l] = p.irregular >> l & 1 ? shape_support(d, K, whole_shape) : 1.0;
  }
}

std::uint8_t LatticeFamilies::live_bits(std::int64_t index) const noexcept {
  const auto alive = body.alive_bits();
  const auto byte = static_cast<std::size_t>(index / 8);
  const int shift = static_cast<int>(index % 8);
  const unsigned pair = alive[byte] | (byte + 1 < alive.size() ? alive[byte + 1] << 8 : 0u);
  return static_cast<std::uint8_t>(pair >> shift);
}

std::uint8_t LatticeFamilies::live_masks(std::int64_t first, std::vector<std::uint8_t>& live_mask) const {
  const std::uint8_t live = live_bits(first);
  live_mask.resize(offsets.size());
  for (std::size_t s = 0; s < offsets.size(); ++s) live_mask[s] = live & live_bits(first + shifts[s]);
  return live;
}

void LatticeFamilies::make_patterns() {
  const std::size_t slots = offsets.size();
  whole.mask.assign(slots, 0xff);
  finish_pattern(whole, whole.mask, true);
  for (int l = 0; l < chunk_points; ++l) {
    for (auto& moment : whole.moment) moment[l] = 0.0;   // exactly, not to rounding
  }
  const bool cracked = !body.cracks().empty();
  std::unordered_map<std::string, std::int32_t> known;
  std::vector<std::uint8_t> live_mask(slots), mask(slots);
  for (LatticeChunk& chunk : chunks) {
    const std::uint8_t live = live_masks(chunk.first, live_mask);
    const bool full = live == 0xff && std::all_of(live_mask.begin(), live_mask.end(), [](std::uint8_t m) { return m == 0xff; });
    mask = live_mask;
    std::uint8_t irregular = 0;
    for (int l = 0; cracked && l < chunk_points; ++l) {
      if (!(live >> l & 1)) continue;
      const Point x = body.position(static_cast<std::size_t>(chunk.first + l));
      const bool candidate = std::any_of(body.cracks().begin(), body.cracks().end(), [&](const Crack& c) { return c.near(x, body.horizon()); });
      for (std::size_t s = 0; candidate && s < slots; ++s) {
        if (!(mask[s] >> l & 1) || !body.cut(x, body.position(static_cast<std::size_t>(chunk.first + l + shifts[s])))) continue;
        mask[s] &= static_cast<std::uint8_t>(~(1u << l));
        irregular |= static_cast<std::uint8_t>(1u << l);
        ++broken;
      }
    }
    for (std::size_t s = 0; s < slots; ++s) bonds += static_cast<std::size_t>(__builtin_popcount(mask[s]));
    if (full && irregular == 0) continue;
    std::string key(mask.begin(), mask.end());
    key.append(live_mask.begin(), live_mask.end());
    key.push_back(static_cast<char>(live));
    const auto [entry, fresh] = known.try_emplace(std::move(key), static_cast<std::int32_t>(patterns.size()));
    if (fresh) {
      LatticePattern& pattern = patterns.emplace_back();
      pattern.mask = mask;
      pattern.live = live;
      pattern.irregular = irregular;
      finish_pattern(pattern, live_mask, true);
    }
    chunk.pattern = entry->second;
    singular += static_cast<std::size_t>(__builtin_popcount(patterns[static_cast<std::size_t>(entry->second)].singular));
  }
}

std::vector<std::uint16_t> LatticeFamilies::intact_slots(const LatticePattern& pattern, int lane) const {
  std::vector<std::uint16_t> slots;
  for (std::size_t s = 0; s < offsets.size(); ++s)
    if (intact(pattern, s, lane)) slots.push_back(static_cast<std::uint16_t>(s));
  return slots;
}

void LatticeFamilies::load(std::span<const std::uint16_t> slots, FamilyArrays& out) const {
  out.resize(lattice.dimension, static_cast<int>(slots.size()));
  for (std::size_t k = 0; k < slots.size(); ++k) {
    const std::array<double, 3> xi = bond(slots[k]);
    for (std::size_t c = 0; c < static_cast<std::size_t>(lattice.dimension); ++c) out.xi[c][k] = xi[c];
    out.length[k] = std::sqrt(xi[0] * xi[0] + xi[1] * xi[1] + xi[2] * xi[2]);
    out.omega[k] = omega[slots[k]];
    out.volume[k] = volume;
  }
}

LatticePattern& LatticeFamilies::own_pattern(LatticeChunk& chunk) {
  if (chunk.pattern < 0 || static_cast<std::size_t>(chunk.pattern) < shared_) {
    owned_.push_back({static_cast<std::int32_t>(&chunk - chunks.data()), chunk.pattern});
    patterns.push_back(LatticePattern(pattern(chunk)));   // a copy first: the vector may move
    chunk.pattern = static_cast<std::int32_t>(patterns.size()) - 1;
  }
  return patterns[static_cast<std::size_t>(chunk.pattern)];
}

std::vector<std::int32_t> LatticeFamilies::break_bonds(std::span<const BondChange> changes) {
  index_chunks();
  std::vector<std::int32_t> ends;
  const auto clear = [&](std::int32_t point, std::size_t slot) {
    LatticePattern& p = own_pattern(chunks[static_cast<std::size_t>(chunk_of(point))]);
    const auto bit = static_cast<std::uint8_t>(1u << (point % chunk_points));
    if (!(p.mask[slot] & bit)) return;
    p.mask[slot] &= static_cast<std::uint8_t>(~bit);
    p.irregular |= bit;
    --bonds, ++broken, ++failed;
    ends.push_back(point);
  };
  for (const BondChange& c : changes) {
    clear(c.point, static_cast<std::size_t>(c.bond));
    clear(c.far, reverse(static_cast<std::size_t>(c.bond)));
  }
  std::sort(ends.begin(), ends.end());
  ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
  std::vector<std::uint8_t> live_mask;
  for (std::size_t k = 0; k < ends.size();) {
    const std::int32_t first = ends[k] / chunk_points * chunk_points;
    unsigned lanes = 0;
    for (; k < ends.size() && ends[k] < first + chunk_points; ++k) lanes |= 1u << (ends[k] - first);
    live_masks(first, live_mask);
    LatticePattern& p = own_pattern(chunks[static_cast<std::size_t>(chunk_of(first))]);
    singular -= static_cast<std::size_t>(__builtin_popcount(p.singular));
    finish_pattern(p, live_mask, false, lanes);
    singular += static_cast<std::size_t>(__builtin_popcount(p.singular));
  }
  return ends;
}

std::vector<BondChange> LatticeFamilies::fragment_bonds(std::span<const std::int32_t> points) const {
  std::vector<BondChange> bonds;
  for (const std::int32_t p : points) {
    const LatticePattern& family = pattern(chunks[static_cast<std::size_t>(chunk_of(p))]);
    const int lane = p % chunk_points;
    if (family.support[lane] >= least_support) continue;
    for (std::size_t s = 0; s < offsets.size(); ++s) {
      if (!intact(family, s, lane)) continue;
      const auto far = static_cast<std::int32_t>(p + shifts[s]);
      if (s < half) bonds.push_back({p, far, static_cast<std::int64_t>(s), 0.0});
      else bonds.push_back({far, p, static_cast<std::int64_t>(reverse(s)), 0.0});
    }
  }
  return bonds;
}

bool LatticeFamilies::lost_bonds(std::int32_t point) const noexcept {
  const LatticeChunk& chunk = chunks[static_cast<std::size_t>(chunk_of(point))];
  if (chunk.pattern < 0 || static_cast<std::size_t>(chunk.pattern) < shared_) return false;
  const LatticePattern& own = pattern(chunk);
  const LatticePattern& original = pattern({chunk.first, owned_[static_cast<std::size_t>(chunk.pattern) - shared_].original});
  for (std::size_t s = 0; s < offsets.size(); ++s)
    if (intact(own, s, point % chunk_points) != intact(original, s, point % chunk_points)) return true;
  return false;
}

std::vector<std::int32_t> LatticeFamilies::mend() {
  std::vector<std::int32_t> points;
  for (std::size_t k = 0; k < owned_.size(); ++k) {
    LatticeChunk& chunk = chunks[static_cast<std::size_t>(owned_[k].chunk)];
    const LatticePattern own = pattern(chunk);
    singular -= static_cast<std::size_t>(__builtin_popcount(own.singular));
    chunk.pattern = owned_[k].original;
    const LatticePattern& original = pattern(chunk);
    singular += static_cast<std::size_t>(__builtin_popcount(original.singular));
    for (int l = 0; l < chunk_points; ++l) {
      const auto differs = [&](std::size_t s) { return intact(own, s, l) != intact(original, s, l); };
      bool any = false;
      for (std::size_t s = 0; s < offsets.size(); ++s) any = any || differs(s);
      if (any) points.push_back(chunk.first + l);
    }
  }
  bonds += failed;
  broken -= failed;
  failed = 0;
  owned_.clear();
  patterns.resize(shared_);
  std::sort(points.begin(), points.end());
  return points;
}

void LatticeFamilies::inverse_shape(const LatticePattern& pattern, int lane, double* out) const noexcept {
  const int d = lattice.dimension;
  const double scale = 1 / (spacing * spacing * volume);
  for (int a = 0; a < d; ++a)
    for (int b = a; b < d; ++b) out[symmetric_index(d, lattice.axis[a], lattice.axis[b])] = scale * pattern.inverse[symmetric_index(d, a, b)][lane];
}

std::size_t LatticeFamilies::bytes() const noexcept {
  return chunks.size() * sizeof(LatticeChunk) + rows.size() * sizeof(LatticeRow) + blocks.size() * sizeof(LatticeBlock) +
         patterns.size() * (sizeof(LatticePattern) + offsets.size()) + chunk_at_.size() * sizeof(std::int32_t) + owned_.size() * sizeof(Owned);
}

}  // namespace perikit
