/// Pair laws on a lattice: packs of contiguous points against their neighbours at one offset, offsets +d only (the force at
/// the far end is the opposite one), slot by slot, with nothing stored by bond.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <numeric>
#include <vector>

#include "families/lattice/lattice_families.hpp"
#include "spaces/lattice/work_of_groups.hpp"
#include "terms/pairs/pair_energy_shares.hpp"
#include "terms/pairs/pair_loop.hpp"

namespace perikit {

namespace {

constexpr int slots_at_once = batch_points / chunk_points;

/// What a loop over the bonds of a chunk has to do beside springs. any: whatever there is of energies, weakened bonds, interfaces
/// and dilatations; the other loops, which most chunks take in steps without energies, are compiled without branches for these.
enum class Extras { none, dilatation, any };

template <int D>
class LatticePairs final : public PairLoop {
 public:
  explicit LatticePairs(const PairLoopParts& parts)
      : PairLoop(parts), law_(*parts.formulation.pairs), fields_(parts.fields), dilatation_(parts.formulation.dilatation != nullptr),
        families_(*parts.families.lattice()), squared_volume_(families_.volume * families_.volume) {
    if (parts.quiet) watch_waves(families_.tiles.reach);
    for (std::size_t s = 0; s < families_.slots.size(); ++s) {
      const auto& xi = families_.slots.xi[s];
      length_.insert(length_.end(), chunk_points, std::sqrt(xi[0] * xi[0] + xi[1] * xi[1] + xi[2] * xi[2]));
      omega_.insert(omega_.end(), chunk_points, families_.slots.omega[s]);
      shortest_.push_back(Stretch<D>::shortest * length_.back());
    }
    std::vector<std::uint16_t> all(families_.slots.size());
    std::iota(all.begin(), all.end(), std::uint16_t{0});
    FamilyArrays family;
    families_.load(all, family);
    AlignedVector<double> share(family.size, 1.0);
    pair_energy_shares(law_, family.bonds, family.length.data(), family.omega.data(), share.data());
    for (std::size_t s = 0; s < all.size(); ++s) inverse_share_.push_back(share[s] > 0 ? 1 / share[s] : 0.0);
    find_needed();
    make_tables();
    length_.resize(length_.size() + batch_points, 1.0);
    omega_.resize(length_.size(), 0.0);
    inverse_length_.resize(length_.size());
    for (std::size_t k = 0; k < length_.size(); k += pack_width) reciprocal(Pack::load(length_.data() + k)).store(inverse_length_.data() + k);
  }

  std::size_t blocks() const noexcept override { return families_.tiles.blocks.size(); }
  std::size_t bytes() const noexcept override { return (3 * length_.size() + moduli_.size() + weights_.size()) * sizeof(double); }

  std::int64_t run(const PairPass& pass) override {
    reset_bad();
    look(pass, [&](std::size_t b) { return families_.tiles.moves(b, pass.u); }, pass.arrival);
    if ((!pass.only || pass.local) && !adds(pass.work)) parallel_for(blocks(), [&](std::size_t b) { families_.tiles.clear(b, pass.out); });
    each_block(pass, families_.tiles.colouring, pass.arrival, [&](auto work, std::size_t b) {
      if (pass.motion) pass.motion->need(families_.tiles.pieces(b));
      run_block<work.value>(b, pass);
    });
    if (pass.motion) pass.motion->finish();   // what no block reads
    return bad();
  }

 private:
  template <PairWork work>
  void run_block(std::size_t b, const PairPass& pass) {
    const LatticeBlock& block = families_.tiles.blocks[b];
    constexpr bool sums = work == PairWork::dilatation || work == PairWork::dilatation_rate;
    for (std::size_t c = block.chunk_begin; c < block.chunk_end; ++c) {
      const LatticeChunk& chunk = families_.tiles.chunks[c];
      if (!needed_[sums].empty() && !needed_[sums][c]) continue;
      if (pass.only) {
        if (!pass.only[chunk.first / chunk_points]) continue;
        for (int k = 0; k < pass.out.components && !pass.local; ++k) std::memset(pass.out.component(k) + chunk.first, 0, sizeof(double) * chunk_points);
      }
      double energy = 0;
      const int lane = at_once(pass) ? run_chunk<work, true>(chunk, pass, energy) : run_chunk<work, false>(chunk, pass, energy);
      if (lane >= 0) return report_bad(chunk.first + lane);
      if (pass.energies) pass.energies[chunk.first / chunk_points].stored += energy;
    }
  }

  /// Chunks whose bonds, each counted at one end, lead to points whose forces are to be complete here, or whose dilatations these
  /// ask for.
  void find_needed() {
    if (!families_.body().part()) return;
    std::vector<std::uint8_t> wanted(families_.body().stride(), 0);
    for (const std::int32_t p : families_.body().complete()) wanted[static_cast<std::size_t>(p)] = 1;
    for (std::vector<std::uint8_t>& needed : needed_) {
      for (const LatticeChunk& chunk : families_.tiles.chunks) {
        const auto any = [&](std::int64_t first) {
          return std::any_of(wanted.begin() + first, wanted.begin() + first + chunk_points,
                             [](std::uint8_t here) { return here != 0; });
        };
        const auto half = families_.slots.shifts.begin() + static_cast<std::ptrdiff_t>(families_.slots.half);
        needed.push_back(any(chunk.first) || std::any_of(families_.slots.shifts.begin(), half,
                                                         [&](std::int64_t shift) { return any(chunk.first + shift); }));
      }
      wanted = affects_owned_points(families_);
    }
  }

  /// c f and omega |xi| f as the loops read them.
  void make_tables() {
    const std::size_t slots = families_.slots.size();
    const BondFactors& factors = *fields_.factors;
    table_size_ = slots * chunk_points + batch_points;
    const auto write = [&](std::size_t s, const double* f) {
      const double weight = omega_[s * chunk_points] * length_[s * chunk_points];
      for (std::size_t l = 0; l < chunk_points; ++l) {
        if (fields_.modulus.size() == 0) moduli_.push_back(fields_.uniform * (f ? f[l] : 1.0));
        if (dilatation_) weights_.push_back(weight * (f && factors.of_dilatation ? f[l] : 1.0));
      }
    };
    for (std::size_t t = 0; t < std::max<std::size_t>(1, factors.tables.size()); ++t) {
      for (std::size_t s = 0; s < slots; ++s) write(s, factors.empty() ? nullptr : factors.tables[t].data() + s * chunk_points);
      if (!moduli_.empty()) moduli_.resize((t + 1) * table_size_, 0.0);
      if (!weights_.empty()) weights_.resize((t + 1) * table_size_, 0.0);
    }
  }
  std::size_t table_of(std::int64_t p) const noexcept {
    return fields_.factors->empty() ? 0 : static_cast<std::size_t>(fields_.factors->table_of[static_cast<std::size_t>(p / chunk_points)]);
  }

  /// Whether the energies of bonds are asked for.
  template <PairWork work>
  static bool stores(const PairPass& pass) noexcept {
    return work == PairWork::energy || (work == PairWork::force && (pass.screen || pass.energies));
  }

  /// Returns the first lane with a bond of zero or non-finite length, or -1.
  template <PairWork work, bool half>
  int run_chunk(const LatticeChunk& chunk, const PairPass& pass, double& energy) const noexcept {
    const bool crosses = dilatation_ && fields_.crosses(static_cast<std::size_t>(chunk.first));
    if (stores<work>(pass) || crosses || !families_.pattern(chunk).integrity.empty())
      return run_chunk<work, half, Extras::any>(chunk, pass, energy);
    if (dilatation_) return run_chunk<work, half, Extras::dilatation>(chunk, pass, energy);
    return run_chunk<work, half, Extras::none>(chunk, pass, energy);
  }
  template <PairWork work, bool half, Extras extras>
  int run_chunk(const LatticeChunk& chunk, const PairPass& pass, double& energy) const noexcept;

  void moduli(const LatticePattern& pattern, std::int64_t p, std::size_t slot, int count, double* out) const noexcept;
  std::array<Pack, 2> own_strains(std::int64_t p, std::int64_t q, std::uint8_t bits) const noexcept;
  void screen(const PairPass& pass, const LatticePattern& pattern, std::int64_t p, std::size_t slot, int count, const PairScratch& s) const noexcept;

  const PairKinematics& law_;
  const PairFields& fields_;
  bool dilatation_;
  const LatticeFamilies& families_;
  double squared_volume_;
  std::vector<std::uint8_t> needed_[2];   ///< by chunk, for forces and for dilatations; empty: all are
  AlignedVector<double> length_, omega_, inverse_length_;  ///< by slot, one value a lane
  AlignedVector<double> moduli_, weights_;   ///< by table: c f, omega |xi| f, [slot][lane], with as many zeros behind as a batch may read; empty: moduli vary, no dilatation
  std::size_t table_size_ = 0;
  std::vector<double> shortest_;          ///< by slot: the extension below which a bond has no length
  std::vector<double> inverse_share_;     ///< by slot: see BondStates::share
};

/// c_ij of the bonds of `count` slots.
template <int D>
void LatticePairs<D>::moduli(const LatticePattern& pattern, std::int64_t p, std::size_t slot, int count, double* out) const noexcept {
  const double *const of_point = fields_.modulus.data() + p,
               *const factor = fields_.factors->empty() ? nullptr : fields_.factors->tables[table_of(p)].data();
  const bool crosses = fields_.crosses(static_cast<std::size_t>(p));
  const auto* const shifts = families_.slots.shifts.data();
  for (int k = 0; k < count; ++k, out += chunk_points) {
    const std::size_t at = slot + static_cast<std::size_t>(k);
    const std::int64_t far = shifts[at];
    for (int l = 0; l < chunk_points; l += pack_width) {
      if (pattern.mask[at] == 0) {
        Pack(0.0).store(out + l);
        continue;
      }
      (Pack(0.5) * (Pack::load(of_point + l) + Pack::load(of_point + far + l))).store(out + l);
    }
    for (int l = 0; l < chunk_points && crosses; ++l)
      if (pattern.mask[at] >> l & 1) out[l] = fields_.of_bond(static_cast<std::size_t>(p + l), static_cast<std::size_t>(p + far + l));
    for (int l = 0; l < chunk_points && factor; l += pack_width)
      (Pack::load(out + l) * Pack::load(factor + at * chunk_points + static_cast<std::size_t>(l))).store(out + l);
  }
}

/// PairFields::own_strain of both ends of a pack of bonds, from p and q on.
template <int D>
std::array<Pack, 2> LatticePairs<D>::own_strains(std::int64_t p, std::int64_t q, std::uint8_t bits) const noexcept {
  alignas(64) double of_own[pack_width], of_far[pack_width];
  for (int i = 0; i < pack_width; ++i) {
    const auto own = static_cast<std::size_t>(p + i), far = static_cast<std::size_t>(q + i);
    of_own[i] = bits >> i & 1 ? fields_.own_strain(own, far) : 1;
    of_far[i] = bits >> i & 1 ? fields_.own_strain(far, own) : 1;
  }
  return {Pack::load(of_own), Pack::load(of_far)};
}

/// Marks the points where a bond holds too much: its energy, over its share where that is asked for.
template <int D>
void LatticePairs<D>::screen(const PairPass& pass, const LatticePattern& pattern, std::int64_t p, std::size_t slot, int count, const PairScratch& s) const noexcept {
  Pack highest[chunk_points / pack_width];
  const bool crosses = fields_.crosses(static_cast<std::size_t>(p));
  const double* const factor = fields_.factors->empty() ? nullptr : fields_.factors->tables[table_of(p)].data();
  for (int k = 0; k < count; ++k) {
    const std::size_t at = slot + static_cast<std::size_t>(k);
    const std::int64_t far = p + families_.slots.shifts[at];
    const Pack per_share(pass.screen->over_share ? inverse_share_[at] : 1.0);
    for (int l = 0; l < chunk_points && pattern.mask[at] != 0; l += pack_width) {
      Pack value = Pack::load(s.energy + k * chunk_points + l);
      if (pass.by_theta) {
        Pack own = Pack::load(pass.by_theta + p + l), other = Pack::load(pass.by_theta + far + l);
        if (crosses) {
          const auto [of_own, of_far] = own_strains(p + l, far + l, static_cast<std::uint8_t>(pattern.mask[at] >> l));
          own *= of_own;
          other *= of_far;
        }
        value += Pack::load(weights_.data() + table_of(p) * table_size_ + at * chunk_points + static_cast<std::size_t>(l)) * Pack::load(s.e + k * chunk_points + l) * (own + other);
      }
      value *= per_share;
      if (factor && pass.screen->over_share) value *= reciprocal(Pack::load(factor + at * chunk_points + static_cast<std::size_t>(l)));
      highest[l / pack_width] = max(highest[l / pack_width], keep(static_cast<std::uint8_t>(pattern.mask[at] >> l), value));
    }
  }
  for (int l = 0; l < chunk_points; ++l)
    if (highest[l / pack_width][l % pack_width] > pass.screen->limit + pass.screen->density[static_cast<std::size_t>(p + l)])
      pass.screen->mark(static_cast<std::size_t>(p + l));
}

template <int D>
template <PairWork work, bool half, Extras extras>
int LatticePairs<D>::run_chunk(const LatticeChunk& chunk, const PairPass& pass, double& total) const noexcept {
  constexpr bool sums = work == PairWork::dilatation || work == PairWork::dilatation_rate;
  constexpr bool rate = work == PairWork::dilatation_rate || work == PairWork::tangent;
  constexpr int packs = chunk_points / pack_width, results = sums || work == PairWork::energy ? 1 : D;
  const LatticePattern& pattern = families_.pattern(chunk);
  const std::int64_t p = chunk.first;
  const std::size_t slots = half ? families_.slots.half : families_.slots.offsets.size();
  constexpr bool any = extras == Extras::any;
  const bool energies = any && stores<work>(pass), screened = energies && work == PairWork::force && pass.screen,
             uniform = fields_.modulus.size() == 0;
  // Locals: packs that are stored may be any member, as far as the compiler knows.
  const bool dilatation = any ? dilatation_ : extras == Extras::dilatation;
  const bool crosses = any && dilatation && fields_.crosses(static_cast<std::size_t>(p));
  const bool weakened = any && !pattern.integrity.empty();  // a b between 0 and 1 weighs all that its bond does
  const double volume = families_.volume, squared_volume = squared_volume_, *const lengths = length_.data(), *const omegas = omega_.data(),
               *const shortest = shortest_.data();
  const auto* const xis = families_.slots.xi.data();
  const auto* const shifts = families_.slots.shifts.data();
  const auto* const masks = &pattern.mask[0];
  const double *u[D], *w[D] = {};
  const double *const q = dilatation && !sums ? pass.q.data + p : nullptr, *const dq = dilatation && rate && !sums ? pass.dq.data + p : nullptr;
  double* out[results];
  for (int c = 0; c < D; ++c) {
    u[c] = pass.u.component(c) + p;
    if constexpr (rate) w[c] = pass.w.component(c) + p;
  }
  for (int c = 0; c < results; ++c) out[c] = pass.out.component(c) + p;
  const auto add_far = [](double* target, std::uint8_t mask, std::uint8_t bits, Pack t) {
    if (mask == 0xff) (Pack::load(target) + t).store(target);
    else subtract_at(target, bits, -t);
  };

  alignas(64) PairScratch s;
  const std::size_t table = table_of(p) * table_size_;
  const double *const of_moduli = moduli_.data() + table, *const weights = weights_.data() + table;
  const auto weight = [weights](std::size_t at, int l) { return Pack::load(weights + at * chunk_points + static_cast<std::size_t>(l)); };
  Pack own[results][packs], stored[packs];
  PackMask finite[packs];
  for (PackMask& f : finite) f = Pack(0.0) == Pack(0.0);
  for (std::size_t slot = 0; slot < slots; slot += slots_at_once) {
    const int count = static_cast<int>(std::min<std::size_t>(slots_at_once, slots - slot));
    // Bonds: extension and direction, kept for the second half of the work. Bond by bond for all eight points, so that what a far end gets comes in
    // the same order whatever the width of a pack is.
    Pack own_u[packs][D], own_w[packs][D], sum[packs];
    for (int v = 0; v < packs; ++v)
      for (int c = 0; c < D; ++c) {
        own_u[v][c] = Pack::load(u[c] + v * pack_width);
        if constexpr (rate) own_w[v][c] = Pack::load(w[c] + v * pack_width);
      }
    for (int k = 0; k < count; ++k) {
      const std::size_t at = slot + static_cast<std::size_t>(k);
      for (int v = 0; v < packs; ++v) {
        const int l = v * pack_width;
        const std::int64_t far = shifts[at] + l;
        const std::uint8_t mask = masks[at], bits = static_cast<std::uint8_t>(mask >> l);
        const int lane = k * chunk_points + l;
        if (mask == 0) {
          Pack(0.0).store(s.e + lane);
          continue;
        }
        const auto difference = [&](const double* field, Pack mine) {
          const Pack d = Pack::load(field + far) - mine;
          return mask == 0xff ? d : keep(bits, d);
        };
        Pack xi[D], du[D], dw[D];
        for (int c = 0; c < D; ++c) {
          xi[c] = Pack(xis[at][static_cast<std::size_t>(c)]);
          du[c] = difference(u[c], own_u[v][c]);
          if constexpr (rate) dw[c] = difference(w[c], own_w[v][c]);
        }
        const double length = lengths[at * chunk_points];
        const Stretch<D> bond(xi, Pack(length), du);
        finite[v] &= bond.e > Pack(shortest[at]);
        if constexpr (sums) {
          Pack term = Pack(volume) * Pack::load(weights + at * chunk_points + static_cast<std::size_t>(l)) * (rate ? bond.along(dw) : bond.e);
          if (weakened) term *= Pack::load(pattern.b_of(at) + l);
          if (crosses) {
            const auto [of_own, of_far] = own_strains(p + l, p + far, bits);
            sum[v] += of_own * term;
            if constexpr (half) add_far(out[0] + far, mask, bits, of_far * term);
            continue;
          }
          sum[v] += term;
          if constexpr (half) add_far(out[0] + far, mask, bits, term);
        } else {
          bond.e.store(s.e + lane);
          for (int c = 0; c < D; ++c) bond.y[c].store(s.y[c] + lane);
          bond.inverse_length.store(s.inverse_length + lane);
          if constexpr (rate) bond.along(dw).store(s.de + lane);
        }
      }
    }
    if constexpr (sums) {
      for (int v = 0; v < packs; ++v) own[0][v] += sum[v];
      continue;
    }
    if (!uniform) moduli(pattern, p, slot, count, s.modulus);
    law_.bond_law({count * chunk_points, lengths + slot * chunk_points, omegas + slot * chunk_points, s.e, uniform ? of_moduli + slot * chunk_points : s.modulus, energies ? s.energy : nullptr,
                   work == PairWork::energy ? nullptr : s.force, work == PairWork::tangent ? s.stiffness : nullptr, inverse_length_.data() + slot * chunk_points});
    if (screened) screen(pass, pattern, p, slot, count, s);
    Pack sum_of[packs][D], sum_stored[packs], own_q[packs], own_dq[packs];
    for (int v = 0; v < packs; ++v) {
      if (dilatation) own_q[v] = Pack::load(q + v * pack_width);
      if (dilatation && rate) own_dq[v] = Pack::load(dq + v * pack_width);
    }
    for (int k = 0; k < count; ++k) {
      const std::size_t at = slot + static_cast<std::size_t>(k);
      for (int v = 0; v < packs; ++v) {
        const int l = v * pack_width;
        const std::int64_t far = shifts[at] + l;
        const std::uint8_t mask = masks[at], bits = static_cast<std::uint8_t>(mask >> l);
        const int lane = k * chunk_points + l;
        if (mask == 0) continue;
        const Pack b = weakened ? Pack::load(pattern.b_of(at) + l) : Pack(1.0);
        if (energies) sum_stored[v] += keep(bits, weakened ? b * Pack::load(s.energy + lane) : Pack::load(s.energy + lane));
        if constexpr (work == PairWork::energy) continue;
        Pack t[D], T = Pack::load(s.force + lane);
        std::array<Pack, 2> strain;
        if (crosses) strain = own_strains(p + l, p + far, bits);
        const auto of_ends = [&](Pack own_value, Pack far_value) { return crosses ? strain[0] * own_value + strain[1] * far_value : own_value + far_value; };
        if (dilatation) T = multiply_add(weight(at, l), of_ends(own_q[v], Pack::load(q + far)), T);
        if constexpr (work == PairWork::force) {
          T = T * Pack(squared_volume) * Pack::load(s.inverse_length + lane);
          for (int c = 0; c < D; ++c) t[c] = T * Pack::load(s.y[c] + lane);
        } else {
          // d(T n) = dT n + T (dw - n de)/|y|, n = y/|y|
          const Pack de = Pack::load(s.de + lane);
          Pack dT = Pack::load(s.stiffness + lane) * de;
          if (dilatation) dT += weight(at, l) * of_ends(own_dq[v], Pack::load(dq + far));
          const Pack inverse_length = Pack::load(s.inverse_length + lane), turn = T * Pack(-squared_volume) * inverse_length;
          const Pack stretch = (dT * Pack(-squared_volume) - turn * de) * inverse_length;
          for (int c = 0; c < D; ++c) t[c] = stretch * Pack::load(s.y[c] + lane) + turn * keep(bits, Pack::load(w[c] + far) - own_w[v][c]);
        }
        for (int c = 0; c < D; ++c) {
          if (weakened) t[c] *= b;
          if (mask != 0xff) t[c] = keep(bits, t[c]);
          sum_of[v][c] += t[c];
          if constexpr (half) add_far(out[c] + far, mask, bits, -t[c]);
        }
      }
    }
    for (int v = 0; v < packs; ++v) {
      if (energies) stored[v] += sum_stored[v];
      if constexpr (work != PairWork::energy)
        for (int c = 0; c < D; ++c) own[c][v] += sum_of[v][c];
    }
  }
  if (work != PairWork::energy && energies) {
    EightSums sums;
    for (int v = 0; v < packs; ++v) sums.at(v * pack_width) = stored[v];
    total += (half ? 1.0 : 0.5) * squared_volume * sums.total();
  }
  int bad = -1;
  for (int l = chunk_points - 1; l >= 0; --l)
    if (!finite[l / pack_width][l % pack_width]) bad = l;
  for (int v = 0; v < packs; ++v) {
    if constexpr (work == PairWork::energy) own[0][v] = Pack(0.5 * volume) * stored[v];
    for (int c = 0; c < results; ++c) {
      double* target = out[c] + v * pack_width;
      (Pack::load(target) + own[c][v]).store(target);
    }
  }
  return bad;
}

}  // namespace

template <int D>
std::unique_ptr<PairLoop> make_lattice_pairs(const PairLoopParts& parts) {
  return std::make_unique<LatticePairs<D>>(parts);
}
template std::unique_ptr<PairLoop> make_lattice_pairs<1>(const PairLoopParts&);
template std::unique_ptr<PairLoop> make_lattice_pairs<2>(const PairLoopParts&);
template std::unique_ptr<PairLoop> make_lattice_pairs<3>(const PairLoopParts&);

}  // namespace perikit
