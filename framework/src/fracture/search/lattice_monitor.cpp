#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>

#include "core/each_once.hpp"
#include "families/lattice/lattice_families.hpp"
#include "families/stretch.hpp"
#include "fracture/body_damage.hpp"
#include "fracture/search/bond_monitor.hpp"

namespace perikit {

namespace {

/// Limits of bonds by those of their ends: BodyDamage::limits without interfaces.
Pack weaker(Pack a, Pack b) noexcept {
  const Pack most(std::numeric_limits<double>::max());
  return select(max(a, b) > most, Pack(std::numeric_limits<double>::infinity()), min(a, b));
}

/// Checks eight points at once, offset by offset; each bond at the end from which it points forward. Margins are stretches.
///
/// The ends of a bond of d cells are joined by a staircase of |d_1| + |d_2| + ... steps to next neighbours, so that they moved apart by
/// at most sum |d_a| M_a, M_a the largest difference of the motion of next neighbours along axis a nearby; and a stretch changed by at
/// most sqrt(sum M_a^2)/spacing. Rigid translations count for nothing. Where cells of the box are empty, staircases may lead through
/// them: their motion counts as zero.
template <int D>
class LatticeMonitor final : public BondMonitor {
 public:
  LatticeMonitor(const LatticeFamilies& families, const BodyDamage& damage, bool skip)
      : BondMonitor(families.body(), skip), families_(families), damage_(damage) {
    for (std::size_t s = 0; s < families.slots.half; ++s) {
      const auto& xi = families.slots.xi[s];
      length_.push_back(std::sqrt(xi[0] * xi[0] + xi[1] * xi[1] + xi[2] * xi[2]));
    }
    const auto& n = families.grid.extent;
    full_box_ = static_cast<std::int64_t>(families.body().points()) == n[0] * n[1] * n[2];
    make_cells();
  }
  std::size_t bytes() const noexcept override {
    std::size_t total = BondMonitor::bytes() + steepest_.size() * sizeof(double);
    for (const auto& near : near_) total += near.size() * sizeof(std::int32_t);
    return total;
  }

 private:
  void make_cells();
  void bound_motion(ConstFieldView u, std::span<double> moved) override;
  /// Largest squared difference of the motion to the next neighbour along each axis.
  void steepest(std::size_t cell, ConstFieldView u);
  double check(const Group& group, ConstFieldView u, std::vector<BondChange>& changes) override;

  const LatticeFamilies& families_;
  const BodyDamage& damage_;
  std::vector<double> length_;              ///< by slot
  bool full_box_;                           ///< every cell of the box holds a point
  std::vector<std::vector<std::int32_t>> near_;   ///< by cell: those that its bonds and their staircases meet, itself too
  std::vector<double> steepest_;            ///< D by cell
};

template <int D>
void LatticeMonitor<D>::make_cells() {
  // Blocks of 8 x 4 x 4 points in 3D, 8 x 8 in 2D: about two horizons wide.
  constexpr std::int64_t across = D == 3 ? 4 : 8;
  std::vector<std::tuple<std::int64_t, std::int64_t, std::int64_t, std::int32_t>> order;
  for (std::size_t c = 0; c < families_.tiles.chunks.size(); ++c) {
    const auto k = families_.grid.cell(families_.tiles.chunks[c].first);
    order.emplace_back(k[2] / across, k[1] / across, k[0] / (D == 1 ? 4 * chunk_points : chunk_points), static_cast<std::int32_t>(c));
  }
  std::sort(order.begin(), order.end());
  std::vector<Group> groups;
  std::vector<std::size_t> first;
  std::vector<std::int32_t> cell_of(body_.stride() / chunk_points, -1);
  for (std::size_t k = 0; k < order.size(); ++k) {
    const auto& [c2, c1, c0, chunk] = order[k];
    if (k == 0 || std::tie(c2, c1, c0) != std::tie(std::get<0>(order[k - 1]), std::get<1>(order[k - 1]), std::get<2>(order[k - 1]))) first.push_back(k);
    const LatticeChunk& own = families_.tiles.chunks[static_cast<std::size_t>(chunk)];
    groups.push_back({own.first, families_.pattern(own).live, chunk});
    cell_of[static_cast<std::size_t>(own.first) / chunk_points] = static_cast<std::int32_t>(first.size()) - 1;
  }
  near_.resize(first.size());
  steepest_.assign(D * first.size(), 0.0);
  first.push_back(groups.size());
  for (std::size_t c = 0; c < near_.size(); ++c) {
    std::vector<std::int32_t>& near = near_[c];
    near.push_back(static_cast<std::int32_t>(c));
    for (std::size_t g = first[c]; g < first[c + 1]; ++g)
      for (const std::int64_t shift : families_.slots.shifts)
        for (const std::int64_t end : {std::int64_t{0}, std::int64_t{chunk_points - 1}}) {
          const auto at = static_cast<std::size_t>(groups[g].first + shift + end) / chunk_points;
          if (at < cell_of.size() && cell_of[at] >= 0 && cell_of[at] != near.back()) near.push_back(cell_of[at]);
        }
    keep_each_once(near);
  }
  set_cells(std::move(groups), std::move(first));
}

template <int D>
void LatticeMonitor<D>::steepest(std::size_t cell, ConstFieldView u) {
  const auto motion = [&](int c, std::int64_t at) { return Pack::load(u.component(c) + at) - Pack::load(reference_.component(c) + at); };
  Pack most[D];
  for (const Group& group : groups_of(cell)) {
    for (int l = 0; l < chunk_points; l += pack_width) {
      const std::int64_t p = group.first + l;
      Pack own[D];
      for (int c = 0; c < D; ++c) own[c] = motion(c, p);
      for (int a = 0; a < D; ++a) {
        std::array<int, 3> next{};
        next[static_cast<std::size_t>(a)] = 1;
        const std::int64_t far = p + families_.grid.shift(next);
        Pack square(0.0);
        for (int c = 0; c < D; ++c) {
          const Pack difference = motion(c, far) - own[c];
          square += difference * difference;
        }
        if (full_box_) {
          const auto both = static_cast<std::uint8_t>((group.live & families_.live_bits(group.first + families_.grid.shift(next))) >> l);
          square = keep(both, square);
        }
        most[a] = select(square > most[a], square, most[a]);
      }
    }
  }
  for (int a = 0; a < D; ++a) {
    double value = 0;
    for (int k = 0; k < pack_width; ++k) value = std::max(value, most[a][k]);
    steepest_[D * cell + static_cast<std::size_t>(a)] = value;
  }
}

template <int D>
void LatticeMonitor<D>::bound_motion(ConstFieldView u, std::span<double> moved) {
  over_cells([&](std::size_t c) { steepest(c, u); });
  over_cells([&](std::size_t c) {
    double sum = 0;
    for (std::size_t a = 0; a < D; ++a) {
      double most = 0;
      for (const std::int32_t k : near_[c]) most = std::max(most, steepest_[D * static_cast<std::size_t>(k) + a]);
      sum += most;
    }
    moved[c] = std::sqrt(sum) / families_.spacing;
  });
}

template <int D>
double LatticeMonitor<D>::check(const Group& group, ConstFieldView u, std::vector<BondChange>& changes) {
  const LatticePattern& pattern = families_.pattern(families_.tiles.chunks[static_cast<std::size_t>(group.item)]);
  const double* onset = damage_.onset.data();
  const Pack never(std::numeric_limits<double>::infinity());
  double margin = std::numeric_limits<double>::infinity();
  for (int l = 0; l < chunk_points; l += pack_width) {
    const std::int64_t p = group.first + l;
    Pack own[D], least = never;
    for (int c = 0; c < D; ++c) own[c] = Pack::load(u.component(c) + p);
    const Pack own_onset = Pack::load(onset + p);
    for (std::size_t s = 0; s < families_.slots.half; ++s) {
      const unsigned bits = pattern.mask[s] >> l & ((1u << pack_width) - 1);
      if (bits == 0) continue;
      const std::int64_t far = p + families_.slots.shifts[s];
      Pack xi[D], du[D];
      for (int c = 0; c < D; ++c) {
        xi[c] = Pack(families_.slots.xi[s][static_cast<std::size_t>(c)]);
        du[c] = Pack::load(u.component(c) + far) - own[c];
      }
      const Stretch<D> bond(xi, Pack(length_[s]), du);
      Pack left = weaker(own_onset, Pack::load(onset + far)) - bond.e * Pack(1 / length_[s]);
      if (!damage_.side.empty())
        for (int k = 0; k < pack_width; ++k) {
          const auto here = static_cast<std::size_t>(p + k), there = static_cast<std::size_t>(far + k);
          if (bits >> k & 1 && damage_.between_sides(here, there)) left.v[k] = damage_.limits(here, there).onset - bond.e[k] / length_[s];
        }
      if (bits != (1u << pack_width) - 1) {
        for (int k = 0; k < pack_width; ++k)
          if (!(bits >> k & 1)) left.v[k] = never[k];
      }
      // A bond within rounding of its limit is left to the criterion itself.
      if (any(left <= Pack(1e-13))) {
        alignas(64) double stretch[chunk_points] = {}, limit[chunk_points] = {}, failure[chunk_points] = {}, b[chunk_points] = {};
        for (int k = 0; k < pack_width; ++k) {
          stretch[k] = bond.e[k] / length_[s];
          if (!(bits >> k & 1)) continue;
          const DamageLimits limits = damage_.limits(static_cast<std::size_t>(p + k), static_cast<std::size_t>(far + k));
          limit[k] = limits.onset;
          failure[k] = limits.failure;
        }
        damage_.law->integrity({pack_width, stretch, limit, failure, b});
        // Bonds between whole and broken keep their margin: they are looked at every time.
        for (int k = 0; k < pack_width; ++k) {
          if (!(bits >> k & 1)) continue;
          if (b[k] < pattern.b(s, l + k)) changes.push_back({{static_cast<std::int32_t>(p + k), static_cast<std::int32_t>(far + k)}, b[k]});
          if (b[k] == 0) left.v[k] = never[k];
        }
      }
      least = select(left < least, left, least);
    }
    for (int k = 0; k < pack_width; ++k) margin = std::min(margin, least[k]);
  }
  return margin;
}

}  // namespace

std::unique_ptr<BondFinder> make_lattice_monitor(const LatticeFamilies& families, const BodyDamage& damage, bool skip) {
  switch (families.grid.dimension) {
    case 1: return std::make_unique<LatticeMonitor<1>>(families, damage, skip);
    case 2: return std::make_unique<LatticeMonitor<2>>(families, damage, skip);
    default: return std::make_unique<LatticeMonitor<3>>(families, damage, skip);
  }
}

}  // namespace perikit
