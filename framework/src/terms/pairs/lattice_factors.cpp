/// Moment factors on a lattice. Bonds that no surface is near have one factor for each offset. Where flat sides meet, one, two or three of them, multipliers depend on the depths below these alone, and a
/// bond has other factors than farther inside only where a side cuts the family of one of its ends: these are known for half spaces, quarter spaces and octants of space. Around all
/// else (steps, holes, pre-cracks, narrow bodies) each point has multipliers of its own.

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <unordered_map>

#include "families/lattice/lattice_families.hpp"
#include "perikit/core/parallel.hpp"
#include "perikit/core/rank_values.hpp"
#include "terms/pairs/lattice_symmetries.hpp"
#include "terms/pairs/lattice_tables.hpp"
#include "terms/pairs/moment_points.hpp"
#include "terms/pairs/moment_sites.hpp"

namespace perikit {

namespace {

std::vector<std::array<int, 3>> regular_offsets(const Body& body) {
  Lattice lattice;
  lattice.dimension = body.dimension();
  lattice.spacing = body.spacing();
  for (int a = 0; a < 3; ++a) lattice.extent[static_cast<std::size_t>(a)] = a < body.dimension() ? std::int64_t{1} << 20 : 1;
  return family_offsets(lattice, body.horizon());
}

/// What flat sides leave of a family, along each axis: on which side something is missing (-1: towards lower cells, 1: towards higher ones, 0: nothing), and how many rows lie
/// before it.
struct Cut {
  bool flat = false;   ///< sides alone cut the family
  std::array<int, 3> side{}, depth{};
};

/// What some flat sides do to a bond: how deep both ends lie below each side, and the symmetry that takes the sides below axes 0, 1, ... in the order in which one end lies below them.
struct BelowSides {
  int sides = 0;
  struct End {
    std::array<int, 3> depth{};
    std::size_t turn = 0;
  } own, other;
};

/// Multipliers below so many sides that meet, by ascending depth.
template <int D>
struct Corner {
  std::map<std::array<int, 3>, std::int32_t> site;
  std::unique_ptr<MomentSites<D>> multipliers;
};

template <int D>
class LatticeFactors {
 public:
  LatticeFactors(const Families& families, const MomentTarget& target, const PointCopies& copies, BondFactors& out)
      : families_(*families.lattice()), body_(families.body()), offsets_(regular_offsets(body_)), copies_(copies), out_(out), symmetries_(offsets_, D) {
    std::map<std::array<int, 3>, std::int32_t> slot_at;
    for (std::size_t s = 0; s < families_.slots.size(); ++s) slot_at[families_.slots.offsets[s]] = static_cast<std::int32_t>(s);
    offset_of_.resize(families_.slots.size());
    for (std::size_t s = 0; s < offsets_.size(); ++s) {
      const auto entry = slot_at.find(offsets_[s]);
      slot_.push_back(entry == slot_at.end() ? -1 : entry->second);
      if (slot_[s] >= 0) offset_of_[static_cast<std::size_t>(slot_[s])] = s;
      weight_.push_back(families_.volume * target.weight[s] / target.trace);
      reach_ = std::max(reach_, std::abs(offsets_[s][0]));
      double square = 0;
      for (std::size_t a = 0; a < D; ++a) square += offsets_[s][a] * offsets_[s][a];
      std::array<double, D> n{};
      for (std::size_t a = 0; a < D; ++a) n[a] = offsets_[s][a] / std::sqrt(square);
      directions_.push_back(n);
    }
  }

  void find() {
    find_cuts();
    find_corner(0);
    out_.inside = corners_[0].multipliers->error(0);
    for (int sides = 1; sides <= std::min(D, most_sides_); ++sides) find_corner(sides);
    find_points();
    make_factors();
    judge();
  }

 private:
  using Link = typename MomentSites<D>::Link;
  struct Directions {
    const LatticeFactors* of;
    const std::uint16_t* slots;   ///< by bond
    void operator()(std::size_t, std::int64_t bond, const std::int32_t*, Pack (&phi)[even_moments<D>], Pack (&)[odd_moments<D>]) const noexcept {
      for (int k = 0; k < even_moments<D>; ++k)
        for (int l = 0; l < pack_width; ++l) phi[k].v[l] = of->polynomials_[slots[bond + l] * static_cast<std::size_t>(even_moments<D>) + static_cast<std::size_t>(k)];
    }
  };

  std::size_t far(std::size_t p, std::size_t slot) const noexcept { return static_cast<std::size_t>(static_cast<std::int64_t>(p) + families_.slots.shifts[slot]); }
  const LatticePattern& pattern(std::size_t p) const noexcept { return families_.pattern_at(p); }
  bool has(std::size_t p, std::size_t slot) const noexcept { return pattern(p).intact(slot, static_cast<int>(p % chunk_points)); }
  /// Of a bond of the body, along the axes of the input.
  void polynomials(std::size_t slot, double (&phi)[even_moments<D>]) const noexcept {
    double n[D];
    for (std::size_t a = 0; a < D; ++a) n[static_cast<std::size_t>(families_.grid.axis[a])] = directions_[offset_of_[slot]][a];
    even_polynomials<D>(n, phi);
  }

  /// Owned points know what cuts their families, ghosts and images get it from their owners and sources.
  void find_cuts() {
    Field code = body_.make_field(1);
    code.fill(-1);
    std::vector<std::array<std::int32_t, chunk_points>> of_pattern(families_.patterns.size());
    for (auto& lanes : of_pattern) lanes.fill(-2);
    constexpr int base = 64;   // depths are smaller
    for (const std::int32_t i : body_.owned()) {
      const auto p = static_cast<std::size_t>(i);
      if (body_.image(p)) continue;
      const LatticeChunk& chunk = families_.tiles.chunks[static_cast<std::size_t>(families_.tiles.chunk_of(i))];
      std::int32_t value = 0;
      if (chunk.pattern >= 0) {
        std::int32_t& lane = of_pattern[static_cast<std::size_t>(chunk.pattern)][p % chunk_points];
        if (lane == -2) {
          const Cut cut = cut_of(families_.pattern(chunk), static_cast<int>(p % chunk_points));
          lane = -1;
          if (cut.flat) {
            lane = 0;
            for (std::size_t a = 0; a < 3; ++a) lane = base * 2 * lane + (cut.side[a] == 0 ? 0 : 2 * cut.depth[a] + (cut.side[a] < 0 ? 1 : 2));
          }
        }
        value = lane;
      }
      code.data()[p] = value + 1;   // 0: not flat
    }
    if (copies_.copy) copies_.copy(code);
    cut_.assign(body_.stride(), {});
    for (const std::int32_t i : body_.internal()) {
      const auto p = static_cast<std::size_t>(i);
      auto value = static_cast<std::int32_t>(code.data()[p]) - 1;
      known_.resize(body_.stride(), 0);
      known_[p] = value >= -1;
      if (value < 0) continue;
      cut_[p].flat = true;
      int sides = 0;
      for (std::size_t a = 3; a-- > 0; value /= 2 * base) {
        const int of_axis = value % (2 * base);
        if (of_axis == 0) continue;
        ++sides;
        cut_[p].depth[a] = (of_axis - 1) / 2;
        cut_[p].side[a] = of_axis % 2 == 1 ? -1 : 1;
        if (!copies_.mirrored.empty() && a < D) cut_[p].side[a] *= copies_.mirrored[p][static_cast<std::size_t>(families_.grid.axis[a])];
      }
      most_sides_ = std::max(most_sides_, sides);
    }
    most_sides_ = static_cast<int>(communicator().largest(most_sides_));
    // Ends of bonds lie below sides that are cut for the other one: up to as many as there are axes.
    if (most_sides_ > 0) most_sides_ = D;
  }

  Cut cut_of(const LatticePattern& pattern, int lane) const {
    Cut cut;
    const auto in = [&](std::size_t s) { return slot_[s] >= 0 && pattern.intact(static_cast<std::size_t>(slot_[s]), lane); };
    std::array<int, 3> low{}, high{};
    for (std::size_t s = 0; s < offsets_.size(); ++s)
      for (std::size_t a = 0; a < D && in(s); ++a) {
        low[a] = std::max(low[a], -offsets_[s][a]);
        high[a] = std::max(high[a], offsets_[s][a]);
      }
    for (std::size_t a = 0; a < D; ++a) {
      if (low[a] < reach_ && high[a] < reach_) return {};
      if (low[a] < reach_) cut.side[a] = -1, cut.depth[a] = low[a];
      if (high[a] < reach_) cut.side[a] = 1, cut.depth[a] = high[a];
    }
    for (std::size_t s = 0; s < offsets_.size(); ++s) {
      bool inside = true;
      for (std::size_t a = 0; a < D; ++a) inside = inside && offsets_[s][a] >= -low[a] && offsets_[s][a] <= high[a];
      if (in(s) != inside) return {};
    }
    cut.flat = true;
    return cut;
  }

  /// Which sides a bond lies below; none where no sides that meet do to it what is done.
  std::optional<BelowSides> below_sides(const Cut& own, const Cut& other, std::size_t s) const noexcept {
    BelowSides below;
    if (!own.flat || !other.flat) return std::nullopt;
    struct Side {
      int axis, side, own, other;
    };
    std::array<Side, 3> sides;
    for (int a = 0; a < D; ++a) {
      const auto i = static_cast<std::size_t>(a);
      const int side = own.side[i] != 0 ? own.side[i] : other.side[i], step = offsets_[s][i];
      if (side == 0) continue;
      const int inwards = side < 0 ? step : -step;
      const int depth = own.side[i] != 0 ? own.depth[i] : other.depth[i] - inwards, behind = depth + inwards;
      const auto fits = [&](const Cut& cut, int row) { return row >= 0 && (cut.side[i] == 0 ? row >= reach_ : cut.side[i] == side && cut.depth[i] == row); };
      if (!fits(own, depth) || !fits(other, behind)) return std::nullopt;
      sides[static_cast<std::size_t>(below.sides++)] = {a, side, depth, behind};
    }
    const auto end = [&](auto depth_of, BelowSides::End& out) {
      std::array<Side, 3> sorted = sides;
      std::stable_sort(sorted.begin(), sorted.begin() + below.sides, [&](const Side& x, const Side& y) { return depth_of(x) < depth_of(y); });
      std::array<int, 3> axis{}, sign{1, 1, 1};
      bool used[3] = {};
      for (int k = 0; k < below.sides; ++k) {
        const auto i = static_cast<std::size_t>(k);
        axis[i] = sorted[i].axis;
        sign[i] = -sorted[i].side;
        used[sorted[i].axis] = true;
        out.depth[i] = depth_of(sorted[i]);
      }
      for (int a = 0, k = below.sides; a < 3; ++a)
        if (!used[a]) axis[static_cast<std::size_t>(k++)] = a;
      out.turn = symmetries_.find(axis, sign);
    };
    end([](const Side& side) { return side.own; }, below.own);
    end([](const Side& side) { return side.other; }, below.other);
    return below;
  }

  /// f of a bond below some sides, of which fewer have been looked at before.
  double factor(const BelowSides& below, std::size_t s) const noexcept {
    const Corner<D>& corner = corners_[static_cast<std::size_t>(below.sides)];
    return corner.multipliers->factor(static_cast<std::size_t>(corner.site.at(below.own.depth)), symmetries_.slot(below.own.turn, s), static_cast<std::size_t>(corner.site.at(below.other.depth)),
                                      symmetries_.slot(below.other.turn, s));
  }

  /// Sites lie below sides across axes 0, 1, ..., ascending: less than two horizons below each.
  void find_corner(int sides) {
    Corner<D>& corner = corners_[static_cast<std::size_t>(sides)];
    std::vector<std::array<int, 3>> depths;
    const int rows = 2 * reach_;
    for (int x = 0; x < (sides > 0 ? rows : 1); ++x)
      for (int y = sides > 1 ? x : 0; y < (sides > 1 ? rows : 1); ++y)
        for (int z = sides > 2 ? y : 0; z < (sides > 2 ? rows : 1); ++z) depths.push_back({x, y, z});
    for (std::size_t k = 0; k < depths.size(); ++k) corner.site[depths[k]] = static_cast<std::int32_t>(k);
    corner.multipliers = std::make_unique<MomentSites<D>>(directions_, sides > 1 ? most_factor : std::numeric_limits<double>::infinity());
    const auto cut_at = [&](const std::array<int, 3>& depth) {
      Cut cut;
      cut.flat = true;
      for (int a = 0; a < sides; ++a)
        if (const auto i = static_cast<std::size_t>(a); depth[i] < reach_) cut.side[i] = -1, cut.depth[i] = depth[i];
      return cut;
    };
    for (const std::array<int, 3>& depth : depths) {
      std::vector<Link> links;
      for (std::size_t s = 0; s < offsets_.size(); ++s) {
        std::array<int, 3> behind = depth;
        bool there = true;
        for (int a = 0; a < sides; ++a) there = there && (behind[static_cast<std::size_t>(a)] += offsets_[s][static_cast<std::size_t>(a)]) >= 0;
        if (!there) continue;
        const BelowSides below = *below_sides(cut_at(depth), cut_at(behind), s);
        if (below.sides < sides) {
          links.push_back({0, number(s), number(s), weight_[s], factor(below, s)});
        } else {
          links.push_back({corner.site.at(below.other.depth), number(symmetries_.slot(below.own.turn, s)), number(symmetries_.slot(below.other.turn, s)), weight_[s], 0});
        }
      }
      // The orders in which a point can have these depths below the sides.
      std::array<int, 3> order = depth;
      int orders = 1;
      while (std::next_permutation(order.begin(), order.begin() + sides)) ++orders;
      corner.multipliers->add(links, orders);
    }
    corner.multipliers->solve();
    out_.iterations += corner.multipliers->iterations();
  }

  /// f where flat sides alone are near; 0: where something else is.
  double regular(std::size_t p, std::size_t s, std::size_t q) const noexcept {
    const std::optional<BelowSides> below = below_sides(cut_[p], cut_[q], s);
    return below ? factor(*below, s) : 0;
  }

  /// Points with a bond that something else is near.
  void find_points() {
    const std::vector<std::int32_t>& owned = body_.owned();
    std::vector<std::uint8_t> chosen(body_.stride(), 0);
    parallel_for(owned.size(), [&](std::size_t k) {
      const auto p = static_cast<std::size_t>(owned[k]);
      if (body_.image(p)) return;
      for (std::size_t slot = 0; slot < families_.slots.size() && !chosen[p]; ++slot)
        if (has(p, slot)) chosen[p] = !below_sides(cut_[p], cut_[far(p, slot)], offset_of_[slot]);
    });
    for (const std::int32_t i : owned) {
      const auto p = static_cast<std::size_t>(i);
      if (!chosen[p]) continue;
      bonds_.points.push_back(i);
      bonds_.begin.push_back(std::ssize(far_));
      for (std::size_t slot = 0; slot < families_.slots.size(); ++slot) {
        if (!has(p, slot)) continue;
        const std::size_t s = offset_of_[slot], q = far(p, slot);
        far_.push_back(static_cast<std::int32_t>(q));
        slot_of_bond_.push_back(number(slot));
        bond_weight_.push_back(weight_[s]);
        bond_known_.push_back(regular(p, s, q));
      }
      bonds_.end.push_back(std::ssize(far_));
    }
    // Behind the bonds of points each slot stands by itself, for bonds of ghosts and images.
    const std::size_t bonds = far_.size() + padding;
    far_.resize(bonds, 0);
    bond_weight_.resize(bonds, 0.0);
    bond_known_.resize(bonds, 0.0);
    slot_of_bond_.resize(bonds, 0);
    first_of_slot_ = std::ssize(slot_of_bond_);
    for (std::size_t slot = 0; slot < families_.slots.size(); ++slot) {
      slot_of_bond_.insert(slot_of_bond_.end(), padding, number(slot));
      double phi[even_moments<D>];
      polynomials(slot, phi);
      polynomials_.insert(polynomials_.end(), std::begin(phi), std::end(phi));
    }
    bonds_.far = far_.data();
    bonds_.weight = bond_weight_.data();
    bonds_.known = bond_known_.data();
    points_ = std::make_unique<MomentPoints<D, false, Directions, Pack>>(body_, bonds_, copies_, Directions{this, slot_of_bond_.data()});
    points_->find();
    out_.iterations += points_->iterations();
    asked_ = std::move(chosen);
  }

  double factor(std::size_t p, std::size_t slot, std::size_t q) const noexcept {
    if (!known_[p] || !known_[q]) return 1;
    const double known = regular(p, offset_of_[slot], q);
    if (known > 0) return known;
    const std::int32_t far[8] = {static_cast<std::int32_t>(q), static_cast<std::int32_t>(q), static_cast<std::int32_t>(q), static_cast<std::int32_t>(q),
                                 static_cast<std::int32_t>(q), static_cast<std::int32_t>(q), static_cast<std::int32_t>(q), static_cast<std::int32_t>(q)};
    return points_->factors(p, first_of_slot_ + static_cast<std::int64_t>(slot) * padding, far)[0];
  }

  bool whole(std::size_t p) const noexcept { return cut_[p].flat && cut_[p].side == std::array<int, 3>{}; }
  void make_factors() {
    for (std::size_t s = 0; s < offsets_.size(); ++s) out_.regular.push_back(factor(BelowSides{}, s));
    std::vector<double> inside(families_.slots.size(), 1.0);
    for (std::size_t slot = 0; slot < inside.size(); ++slot) inside[slot] = out_.regular[offset_of_[slot]];
    make_tables(families_, inside, [&](const LatticeChunk& chunk) {
      for (auto p = static_cast<std::size_t>(chunk.first), l = std::size_t{0}; l < chunk_points; ++l, ++p) {
        if (!whole(p)) return false;
        for (std::size_t slot = 0; slot < families_.slots.size(); ++slot)
          if (!whole(far(p, slot))) return false;
      }
      return true;
    }, [&](std::size_t p, std::size_t slot, std::size_t q) { return factor(p, slot, q); }, out_);
  }

  /// Of a point that flat sides alone are near: the largest of what meets there.
  double regular_error(std::size_t p) const noexcept {
    double error = corners_[0].multipliers->error(0);
    for (std::size_t slot = 0; slot < families_.slots.size(); ++slot) {
      if (!has(p, slot)) continue;
      const BelowSides below = *below_sides(cut_[p], cut_[far(p, slot)], offset_of_[slot]);
      const Corner<D>& corner = corners_[static_cast<std::size_t>(below.sides)];
      error = std::max(error, corner.multipliers->error(static_cast<std::size_t>(corner.site.at(below.own.depth))));
    }
    return error;
  }

  void judge() {
    FactorsFound found;
    for (const std::int32_t i : body_.owned()) {
      const auto p = static_cast<std::size_t>(i);
      if (body_.image(p)) continue;
      const double* const f = out_.tables[static_cast<std::size_t>(out_.table_of[p / chunk_points])].data() + p % chunk_points;
      bool any = false;
      for (std::size_t slot = 0; slot < families_.slots.size(); ++slot) {
        if (!has(p, slot)) continue;
        any = true;
        found.add(f[slot * chunk_points]);
      }
      if (any) found.add(i, asked_[p] ? points_->error(p) : out_.table_of[p / chunk_points] == 0 ? corners_[0].multipliers->error(0) : regular_error(p));
    }
    judge_factors(body_, found, out_);
  }

  static std::uint16_t number(std::size_t s) noexcept { return static_cast<std::uint16_t>(s); }

  const LatticeFamilies& families_;
  const Body& body_;
  std::vector<std::array<int, 3>> offsets_;            ///< of a whole family; the bonds of a narrow body are some of these
  std::vector<std::int32_t> slot_;                     ///< by offset: that of the families; -1: the body is too narrow for one
  std::vector<std::size_t> offset_of_;                 ///< by slot of the families
  const PointCopies& copies_;
  BondFactors& out_;
  LatticeSymmetries symmetries_;
  int reach_ = 0, most_sides_ = 0;
  std::vector<double> weight_;                         ///< by offset, over the trace that is wanted
  std::vector<std::array<double, D>> directions_;      ///< by offset, internal axes
  std::vector<Cut> cut_;                               ///< by point
  std::vector<std::uint8_t> known_;                    ///< by point: whether anybody knows what cuts its family
  Corner<D> corners_[4];                               ///< by the number of sides that meet
  // Points that something else is near.
  MomentBonds bonds_;
  std::vector<std::int32_t> far_;
  std::vector<std::uint16_t> slot_of_bond_;
  std::vector<double> bond_weight_, bond_known_;
  std::vector<double> polynomials_;                    ///< [slot][moment]
  std::int64_t first_of_slot_ = 0;
  std::unique_ptr<MomentPoints<D, false, Directions, Pack>> points_;
  std::vector<std::uint8_t> asked_;                    ///< by point
};

}  // namespace

template <int D>
void lattice_factors(const Families& families, const MomentTarget& target, const PointCopies& copies, BondFactors& out) {
  LatticeFactors<D>(families, target, copies, out).find();
}
template void lattice_factors<1>(const Families&, const MomentTarget&, const PointCopies&, BondFactors&);
template void lattice_factors<2>(const Families&, const MomentTarget&, const PointCopies&, BondFactors&);
template void lattice_factors<3>(const Families&, const MomentTarget&, const PointCopies&, BondFactors&);

}  // namespace perikit
