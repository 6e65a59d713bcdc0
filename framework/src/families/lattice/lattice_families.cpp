#include "families/lattice/lattice_families.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <unordered_map>
#include <utility>

#include "core/each_once.hpp"
#include "families/shape_tensor.hpp"

namespace perikit {

LatticeFamilies::LatticeFamilies(const Body& b, std::shared_ptr<const InfluenceFunction> influence, FamilyNeeds needs)
    : Families(b, std::move(influence), needs), grid(*b.lattice()), spacing(grid.spacing), volume(b.uniform_volume()),
      slots(grid, b.horizon(), needs.influence ? influence_.get() : nullptr), tiles(b, slots) {
  make_patterns();
  shared_ = patterns.size();
}

void LatticeFamilies::finish_pattern(LatticePattern& p, const std::vector<std::uint8_t>& live_mask, bool set_up, unsigned lanes) const {
  const int d = grid.dimension;
  for (int l = 0; l < chunk_points; ++l) {
    if (!(lanes >> l & 1)) continue;
    const bool live = p.live >> l & 1, irregular = p.irregular >> l & 1;
    double K[6] = {}, uncut[6] = {}, moment[3] = {}, live_omega = 0, intact_omega = 0, volumes = 0, influences = 0, inverse[6] = {}, condition = 0;
    for (std::size_t s = 0; s < slots.size(); ++s) {
      if (!(live_mask[s] >> l & 1)) continue;
      const auto& offset = slots.offsets[s];
      const auto add_shape = [&](double w, double* shape) {
        for (int a = 0; a < d; ++a)
          for (int c = a; c < d; ++c) shape[symmetric_index(d, a, c)] += w * offset[static_cast<std::size_t>(a)] * offset[static_cast<std::size_t>(c)];
      };
      live_omega += slots.omega[s];
      volumes += volume;
      influences += slots.omega[s] * volume;
      if (irregular) add_shape(slots.omega[s], uncut);
      if (!p.intact(s, l)) continue;
      const double w = p.b(s, l) * slots.omega[s];
      intact_omega += w;
      add_shape(w, K);
    }
    // Of a bond and the one opposite together, so that whole families have none, exactly: a chunk that is whole may be cut where a part of
    // the body ends, and its whole families must not show it.
    const auto weight = [&](std::size_t s) { return live_mask[s] >> l & 1 ? p.b(s, l) * slots.omega[s] : 0.0; };
    for (std::size_t s = 0; s < slots.half; ++s)
      for (int a = 0; a < d; ++a) moment[a] += (weight(s) - weight(slots.reverse(s))) * slots.offsets[s][static_cast<std::size_t>(a)];
    if (set_up) p.intact_at_set_up[l] = intact_omega;
    p.left[l] = p.intact_at_set_up[l] > 0 ? intact_omega / p.intact_at_set_up[l] : 1.0;
    const double support = live && needs_.shapes && p.left[l] < 1 ? shape_support(d, K, uncut) : 1.0;
    const bool needle = support < needle_support;
    const bool invertible = invert_shape(d, K, inverse, &condition) && !needle, regular = needs_.shapes ? invertible : intact_omega > 0;
    if (needle) {
      std::fill_n(inverse, 6, 0.0);
      condition = std::numeric_limits<double>::infinity();
    }
    const auto mark = [l](std::uint8_t& lanes, bool marked) { lanes = static_cast<std::uint8_t>((lanes & ~(1u << l)) | (marked ? 1u << l : 0u)); };
    mark(p.singular, live && !regular);
    mark(p.fragment, support < least_support);
    for (int c = 0; c < 6; ++c) p.inverse[c][l] = live ? inverse[c] : 0.0;
    for (int c = 0; c < 3; ++c) p.moment[c][l] = live ? moment[c] : 0.0;
    const double share = live_omega > 0 ? intact_omega / live_omega : 0.0;
    p.damage[l] = live && live_omega > 0 ? 1 - share : 0.0;
    p.weight[l] = live ? volume * share : 0.0;
    p.scale[0][l] = live && volumes > 0 ? volume / volumes : 0.0;
    p.scale[1][l] = live && influences > 0 ? volume / influences : 0.0;
    p.condition[l] = live ? condition : 0.0;
  }
}

std::uint8_t LatticeFamilies::live_bits(std::int64_t index) const noexcept {
  const auto alive = body_.alive_bits();
  const auto byte = static_cast<std::size_t>(index / 8);
  const int shift = static_cast<int>(index % 8);
  const unsigned pair = alive[byte] | (byte + 1 < alive.size() ? alive[byte + 1] << 8 : 0u);
  return static_cast<std::uint8_t>(pair >> shift);
}

std::uint8_t LatticeFamilies::live_masks(std::int64_t first, std::vector<std::uint8_t>& live_mask) const {
  const std::uint8_t live = live_bits(first);
  live_mask.resize(slots.size());
  for (std::size_t s = 0; s < slots.size(); ++s) live_mask[s] = live & live_bits(first + slots.shifts[s]);
  return live;
}

std::uint8_t LatticeFamilies::cut_bonds(const LatticeChunk& chunk, std::uint8_t live, std::vector<std::uint8_t>& mask) {
  std::uint8_t irregular = 0;
  for (int l = 0; l < chunk_points; ++l) {
    if (!(live >> l & 1)) continue;
    const Point x = body_.position(static_cast<std::size_t>(chunk.first + l));
    const bool candidate = std::any_of(body_.cracks().begin(), body_.cracks().end(), [&](const Crack& c) { return c.near(x, body_.horizon()); });
    for (std::size_t s = 0; candidate && s < slots.size(); ++s) {
      if (!(mask[s] >> l & 1) || !body_.cut(x, body_.position(static_cast<std::size_t>(chunk.first + l + slots.shifts[s])))) continue;
      mask[s] &= static_cast<std::uint8_t>(~(1u << l));
      irregular |= static_cast<std::uint8_t>(1u << l);
      ++cut_;
    }
  }
  return irregular;
}

void LatticeFamilies::make_patterns() {
  whole.mask.assign(slots.size(), 0xff);
  finish_pattern(whole, whole.mask, true);
  std::unordered_map<std::string, std::int32_t> known;
  std::vector<std::uint8_t> live_mask, mask;
  for (LatticeChunk& chunk : tiles.chunks) {
    const std::uint8_t live = live_masks(chunk.first, live_mask);
    const bool full = live == 0xff && std::all_of(live_mask.begin(), live_mask.end(), [](std::uint8_t m) { return m == 0xff; });
    mask = live_mask;
    const std::uint8_t irregular = body_.cracks().empty() ? std::uint8_t{0} : cut_bonds(chunk, live, mask);
    for (const std::uint8_t m : mask) bonds_ += static_cast<std::size_t>(__builtin_popcount(m));
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
    singular_ += static_cast<std::size_t>(__builtin_popcount(pattern(chunk).singular));
  }
}

std::vector<std::uint16_t> LatticeFamilies::intact_slots(const LatticePattern& pattern, int lane) const {
  std::vector<std::uint16_t> intact;
  for (std::size_t s = 0; s < slots.size(); ++s)
    if (pattern.intact(s, lane)) intact.push_back(static_cast<std::uint16_t>(s));
  return intact;
}

void LatticeFamilies::load(std::span<const std::uint16_t> of, FamilyArrays& out) const {
  out.resize(grid.dimension, static_cast<int>(of.size()));
  out.fragment = false;
  out.integrity.clear();
  out.whole.clear();
  for (std::size_t k = 0; k < of.size(); ++k) {
    const std::array<double, 3>& xi = slots.xi[of[k]];
    for (std::size_t c = 0; c < static_cast<std::size_t>(grid.dimension); ++c) out.xi[c][k] = xi[c];
    out.length[k] = std::sqrt(xi[0] * xi[0] + xi[1] * xi[1] + xi[2] * xi[2]);
    out.omega[k] = slots.omega[of[k]];
    out.volume[k] = volume;
    out.far[k] = static_cast<std::int32_t>(slots.shifts[of[k]]);
  }
}

void LatticeFamilies::load(std::size_t p, BondsOf which, FamilyArrays& out) const {
  const int lane = static_cast<int>(p % chunk_points);
  const LatticeChunk& chunk = tiles.chunks[static_cast<std::size_t>(tiles.chunk_of(static_cast<std::int64_t>(p)))];
  const LatticePattern &now = pattern(chunk), &first = set_up_pattern(chunk);
  std::vector<std::uint16_t> of;
  bool broken = false;
  for (const std::uint16_t s : slots.ascending) {
    const bool in = which == BondsOf::intact ? now.intact(s, lane)
                    : which == BondsOf::set_up ? first.intact(s, lane) : body_.alive(p + static_cast<std::size_t>(slots.shifts[s]));
    if (!in) continue;
    of.push_back(s);
    broken = broken || now.b(s, lane) != 1;
  }
  load(of, out);
  out.owner = static_cast<std::int32_t>(p);
  for (std::int32_t& far : out.far) far += out.owner;
  inverse_shape(now, lane, out.inverse_shape);
  out.fragment = is_fragment(p) && !std::isfinite(condition(p));
  if (!broken) return;
  out.whole = out.omega;
  out.integrity.assign(out.size, 1.0);
  for (std::size_t k = 0; k < of.size(); ++k) {
    out.integrity[k] = now.b(of[k], lane);
    out.omega[k] *= out.integrity[k];
  }
}

void LatticeFamilies::each_class(const std::function<void(std::span<const std::int32_t>)>& visit) const {
  std::vector<std::vector<std::int32_t>> members(patterns.size() + 1);
  for (const LatticeChunk& chunk : tiles.chunks) members[static_cast<std::size_t>(chunk.pattern + 1)].push_back(chunk.first);
  std::vector<std::int32_t> points;
  for (std::size_t k = 0; k < members.size(); ++k) {
    const LatticePattern& own = pattern(static_cast<std::int32_t>(k) - 1);
    for (int lane = 0; lane < chunk_points && !members[k].empty(); ++lane) {
      if (!(own.live >> lane & 1)) continue;
      if (k > 0 || lane == 0) points.clear();   // all lanes of whole patterns are one class
      for (const std::int32_t first : members[k]) points.push_back(first + lane);
      if (k > 0 || lane == chunk_points - 1) visit(points);
    }
  }
}

double LatticeFamilies::normaliser(std::size_t p, BondWeight kind) const noexcept {
  const double scale = pattern_at(p).scale_of(kind)[p % chunk_points];
  return scale > 0 ? volume / scale : 0.0;
}

const LatticePattern& LatticeFamilies::set_up_pattern(const LatticeChunk& chunk) const noexcept {
  const auto k = static_cast<std::size_t>(chunk.pattern);
  return chunk.pattern < 0 || k < shared_ ? pattern(chunk) : pattern(owned_[k - shared_].original);
}

LatticePattern& LatticeFamilies::own_pattern(LatticeChunk& chunk) {
  if (chunk.pattern < 0 || static_cast<std::size_t>(chunk.pattern) < shared_) {
    owned_.push_back({static_cast<std::int32_t>(&chunk - tiles.chunks.data()), chunk.pattern});
    patterns.push_back(LatticePattern(pattern(chunk)));   // a copy first: the vector may move
    chunk.pattern = static_cast<std::int32_t>(patterns.size()) - 1;
  }
  return patterns[static_cast<std::size_t>(chunk.pattern)];
}

unsigned LatticeFamilies::broken_lanes(const LatticePattern& pattern, const std::vector<std::uint8_t>& live_mask) const {
  unsigned lanes = 0;
  for (std::size_t s = 0; s < slots.size(); ++s)
    for (int l = 0; l < chunk_points; ++l)
      if (live_mask[s] >> l & 1 && pattern.b(s, l) != 1) lanes |= 1u << l;
  return lanes;
}

std::vector<std::int32_t> LatticeFamilies::set_bonds(std::span<const BondChange> changes) {
  std::vector<std::int32_t> ends;
  const auto set = [&](std::int32_t point, std::size_t slot, double b) {
    LatticePattern& p = own_pattern(tiles.chunks[static_cast<std::size_t>(tiles.chunk_of(point))]);
    const auto lane = static_cast<std::size_t>(point) % chunk_points;
    const auto bit = static_cast<std::uint8_t>(1u << lane);
    if (p.integrity.empty() && b > 0 && b < 1) {
      p.integrity.resize(slots.size() * chunk_points);
      for (std::size_t s = 0; s < slots.size(); ++s)
        std::copy_n(lane_factors[p.mask[s]], chunk_points, p.integrity.data() + s * chunk_points);
    }
    if (!p.integrity.empty()) p.integrity[slot * chunk_points + lane] = b;
    p.mask[slot] = static_cast<std::uint8_t>(b == 0 ? p.mask[slot] & ~bit : p.mask[slot] | bit);
    ends.push_back(point);
  };
  for (const auto& [bond, integrity] : changes) {
    const std::size_t slot = slots.with_shift(bond.far - bond.point);
    set(bond.point, slot, integrity);
    set(bond.far, slots.reverse(slot), integrity);
  }
  keep_each_once(ends);
  std::vector<std::uint8_t> live_mask;
  for (std::size_t k = 0; k < ends.size();) {
    const std::int32_t first = ends[k] / chunk_points * chunk_points;
    unsigned lanes = 0;
    for (; k < ends.size() && ends[k] < first + chunk_points; ++k) lanes |= 1u << (ends[k] - first);
    live_masks(first, live_mask);
    LatticePattern& pattern = own_pattern(tiles.chunks[static_cast<std::size_t>(tiles.chunk_of(first))]);
    // A bond that was lowered on trial is whole again: nothing may depend on such a trial, of which no checkpoint knows.
    pattern.irregular = static_cast<std::uint8_t>((pattern.irregular & ~lanes) | (lanes & broken_lanes(pattern, live_mask)));
    finish_pattern(pattern, live_mask, false, lanes);
  }
  return ends;
}

std::vector<std::int32_t> LatticeFamilies::mend_bonds() {
  std::vector<std::int32_t> points;
  for (const Owned& owned : owned_) {
    LatticeChunk& chunk = tiles.chunks[static_cast<std::size_t>(owned.chunk)];
    for (int l = 0; l < chunk_points; ++l)
      if (lost_bonds(static_cast<std::size_t>(chunk.first + l))) points.push_back(chunk.first + l);
  }
  for (const Owned& owned : owned_) tiles.chunks[static_cast<std::size_t>(owned.chunk)].pattern = owned.original;
  owned_.clear();
  patterns.resize(shared_);
  std::sort(points.begin(), points.end());
  return points;
}

std::vector<BondChange> LatticeFamilies::changed() const {
  std::vector<BondChange> changes;
  for (const Owned& owned : owned_) {
    const LatticeChunk& chunk = tiles.chunks[static_cast<std::size_t>(owned.chunk)];
    const LatticePattern &now = pattern(chunk), &first = pattern(owned.original);
    for (std::size_t s = 0; s < slots.half; ++s)
      for (int l = 0; l < chunk_points; ++l)
        if (first.intact(s, l) && now.b(s, l) != 1)
          changes.push_back({{chunk.first + l, static_cast<std::int32_t>(chunk.first + l + slots.shifts[s])}, now.b(s, l)});
  }
  std::sort(changes.begin(), changes.end(), [](const BondChange& a, const BondChange& b) { return a.bond < b.bond; });
  return changes;
}

bool LatticeFamilies::lost_bonds(std::size_t p) const noexcept {
  const LatticeChunk& chunk = tiles.chunks[static_cast<std::size_t>(tiles.chunk_of(static_cast<std::int64_t>(p)))];
  const LatticePattern &now = pattern(chunk), &first = set_up_pattern(chunk);
  const int lane = static_cast<int>(p % chunk_points);
  for (std::size_t s = 0; &now != &first && s < slots.size(); ++s)
    if (now.b(s, lane) != first.b(s, lane)) return true;
  return false;
}

double LatticeFamilies::integrity(BondId bond) const noexcept {
  return pattern_at(static_cast<std::size_t>(bond.point)).b(slots.with_shift(bond.far - bond.point), bond.point % chunk_points);
}

void LatticeFamilies::mark(std::span<const std::int32_t> points, GroupMarks& marks) const {
  // Group by group and row by row: what all its points reach in a row at once.
  std::vector<std::uint8_t> lanes(marks.size(), 0);
  std::vector<std::int64_t> groups;
  for (const std::int32_t p : points) {
    std::uint8_t& of_group = lanes[static_cast<std::size_t>(p) / chunk_points];
    if (of_group == 0) groups.push_back(p / chunk_points);
    of_group |= static_cast<std::uint8_t>(1 << p % chunk_points);
  }
  const auto alive = body_.alive_bits();
  for (const std::int64_t group : groups) {
    const unsigned own = lanes[static_cast<std::size_t>(group)];
    const int lowest = std::countr_zero(own), highest = static_cast<int>(std::bit_width(own)) - 1;
    marks[static_cast<std::size_t>(group)] = whole_group;
    const auto mark_if = [&](std::int64_t far, unsigned reached) {
      if (far >= 0 && far < std::ssize(marks) && (reached & alive[static_cast<std::size_t>(far)])) marks[static_cast<std::size_t>(far)] = whole_group;
    };
    // Of the points of a group its highest one reaches farthest in the groups after it, and its lowest one in those before it.
    const auto mark_row = [&](std::int64_t shift, int reach) {
      const std::int64_t here = group + shift / chunk_points;
      unsigned within = own;
      for (int step = 0; step < std::min(reach, chunk_points - 1); ++step) within |= within << 1 | within >> 1;
      mark_if(here, within);
      for (int last = highest + reach - chunk_points, k = 1; last >= 0; last -= chunk_points, ++k) {
        const unsigned up_to = (2u << std::min(last, chunk_points - 1)) - 1;
        mark_if(here + k, up_to);
      }
      for (int first = lowest - reach + chunk_points, k = 1; first < chunk_points; first += chunk_points, ++k) mark_if(here - k, 0xffu << std::max(first, 0));
    };
    if (slots.own_row >= 0) mark_row(0, slots.profiles[static_cast<std::size_t>(slots.own_row)].reach);
    for (const RowPair& row : slots.row_pairs) {
      mark_row(row.shift, row.reach);
      mark_row(-row.shift, row.reach);
    }
  }
}

void LatticeFamilies::inverse_shape(const LatticePattern& pattern, int lane, double* out) const noexcept {
  const int d = grid.dimension;
  const double scale = 1 / (spacing * spacing * volume);
  for (int a = 0; a < d; ++a)
    for (int b = a; b < d; ++b) out[symmetric_index(d, grid.axis[a], grid.axis[b])] = scale * pattern.inverse[symmetric_index(d, a, b)][lane];
}

std::size_t LatticeFamilies::bytes() const noexcept {
  std::size_t weakened = 0;
  for (const LatticePattern& pattern : patterns) weakened += pattern.integrity.size() * sizeof(double);
  return tiles.bytes() + patterns.size() * (sizeof(LatticePattern) + slots.size()) + weakened + owned_.size() * sizeof(Owned);
}

}  // namespace perikit
