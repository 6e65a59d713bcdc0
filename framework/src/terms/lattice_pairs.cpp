/// Pair laws on a lattice: packs of contiguous points against their neighbours at one offset, offsets +d only (the force at
/// the far end is the opposite one), slot by slot, with nothing stored by bond.

#include <cmath>
#include <cstring>
#include <numeric>
#include <vector>

#include "families/lattice_families.hpp"
#include "terms/energy_shares.hpp"
#include "terms/pair_loop.hpp"

namespace perikit {

namespace {

constexpr int slots_at_once = batch_points / chunk_points;

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
    }
    std::vector<std::uint16_t> all(families_.slots.size());
    std::iota(all.begin(), all.end(), std::uint16_t{0});
    FamilyArrays family;
    AlignedVector<double> share;
    families_.load(all, family);
    energy_shares(parts.formulation, D, family, share);
    for (std::size_t s = 0; s < all.size(); ++s) inverse_share_.push_back(share[s] > 0 ? 1 / share[s] : 0.0);
    length_.resize(length_.size() + batch_points, 1.0);
    omega_.resize(length_.size(), 0.0);
  }

  std::size_t blocks() const noexcept override { return families_.tiles.blocks.size(); }
  bool owns(std::size_t b) const noexcept override { return families_.tiles.owns(b); }
  std::size_t bytes() const noexcept override { return (length_.size() + omega_.size()) * sizeof(double); }

  std::int64_t run(const PairPass& pass) override {
    reset_bad();
    look(pass, [&](std::size_t b) { return families_.tiles.moves(b, pass.u); });
    if ((!pass.only || pass.local) && !adds(pass.work)) parallel_for(blocks(), [&](std::size_t b) { families_.tiles.clear(b, pass.out); });
    each_block(pass, families_.tiles.colouring, [&](auto work, std::size_t b) { run_block<work.value>(b, pass); });
    return bad();
  }

 private:
  template <PairWork work>
  void run_block(std::size_t b, const PairPass& pass) {
    const LatticeBlock& block = families_.tiles.blocks[b];
    double energy = 0;
    for (std::size_t c = block.chunk_begin; c < block.chunk_end; ++c) {
      const LatticeChunk& chunk = families_.tiles.chunks[c];
      if (pass.only) {
        if (!pass.only[chunk.first / chunk_points]) continue;
        for (int k = 0; k < pass.out.components && !pass.local; ++k) std::memset(pass.out.component(k) + chunk.first, 0, sizeof(double) * chunk_points);
      }
      const int lane = at_once(pass) ? run_chunk<work, true>(chunk, pass, energy) : run_chunk<work, false>(chunk, pass, energy);
      if (lane < 0) continue;
      report_bad(chunk.first + lane);
      return;
    }
    if (pass.energies) pass.energies[b] = energy;
  }

  /// Returns the first lane with a bond of zero or non-finite length, or -1.
  template <PairWork work, bool half>
  int run_chunk(const LatticeChunk& chunk, const PairPass& pass, double& energy) const noexcept;

  const PairKinematics& law_;
  const PairFields& fields_;
  bool dilatation_;
  const LatticeFamilies& families_;
  double squared_volume_;
  AlignedVector<double> length_, omega_;  ///< by slot, one value a lane
  std::vector<double> inverse_share_;     ///< by slot: see BondStates::share
};

template <int D>
template <PairWork work, bool half>
int LatticePairs<D>::run_chunk(const LatticeChunk& chunk, const PairPass& pass, double& total) const noexcept {
  constexpr bool sums = work == PairWork::dilatation || work == PairWork::dilatation_rate;
  constexpr bool rate = work == PairWork::dilatation_rate || work == PairWork::tangent;
  constexpr int packs = chunk_points / pack_width, results = sums || work == PairWork::energy ? 1 : D;
  const LatticePattern& pattern = families_.pattern(chunk);
  const bool weakened = !pattern.integrity.empty();   // some b lies between 0 and 1: it weighs all that its bond does
  const std::int64_t p = chunk.first;
  const std::size_t slots = half ? families_.slots.half : families_.slots.offsets.size();
  const bool screened = work == PairWork::force && pass.screen,
             energies = work == PairWork::energy || screened || (work == PairWork::force && pass.energies);
  Pack highest[packs];  // energy of a bond, over its share where that is asked for
  const bool uniform = fields_.modulus.size() == 0, crosses = fields_.crosses(static_cast<std::size_t>(p));
  alignas(64) PairScratch s;
  if constexpr (!sums) {
    if (uniform)
      for (double& c : s.modulus) c = fields_.uniform;
  }
  Pack own_u[D][packs], own_w[D][packs], own[results][packs], stored[packs];
  for (int c = 0; c < D; ++c)
    for (int v = 0; v < packs; ++v) {
      own_u[c][v] = Pack::load(pass.u.component(c) + p + v * pack_width);
      if constexpr (rate) own_w[c][v] = Pack::load(pass.w.component(c) + p + v * pack_width);
    }
  PackMask finite[packs];
  for (PackMask& f : finite) f = Pack(0.0) == Pack(0.0);
  for (std::size_t slot = 0; slot < slots; slot += slots_at_once) {
    const int count = static_cast<int>(std::min<std::size_t>(slots_at_once, slots - slot));
    // Bonds: extension and direction, kept for the second half of the work.
    for (int k = 0; k < count; ++k) {
      const std::size_t at = slot + static_cast<std::size_t>(k);
      const std::int64_t far = p + families_.slots.shifts[at];
      const std::uint8_t mask = pattern.mask[at];
      if (mask == 0) {
        for (int lane = k * chunk_points; lane < (k + 1) * chunk_points; lane += pack_width) {
          Pack(0.0).store(s.e + lane);
          if (!uniform) Pack(0.0).store(s.modulus + lane);
        }
        continue;
      }
      Pack xi[D];
      for (int c = 0; c < D; ++c) xi[c] = Pack(families_.slots.xi[at][static_cast<std::size_t>(c)]);
      for (int v = 0; v < packs; ++v) {
        const int l = v * pack_width, lane = k * chunk_points + l;
        const auto bits = static_cast<std::uint8_t>(mask >> l);
        const auto difference = [&](ConstFieldView u, int c, Pack mine) {
          const Pack d = Pack::load(u.component(c) + far + l) - mine;
          return mask == 0xff ? d : keep(bits, d);
        };
        Pack du[D], dw[D];
        for (int c = 0; c < D; ++c) {
          du[c] = difference(pass.u, c, own_u[c][v]);
          if constexpr (rate) dw[c] = difference(pass.w, c, own_w[c][v]);
        }
        const Pack length(length_[at * chunk_points]);
        const Stretch<D> bond(xi, length, du);
        finite[v] &= bond.e == bond.e;
        if constexpr (sums) {
          Pack term = Pack(omega_[at * chunk_points] * length_[at * chunk_points] * families_.volume) * (rate ? bond.along(dw) : bond.e);
          if (weakened) term *= Pack::load(pattern.b_of(at) + l);
          own[0][v] += term;
          if constexpr (half) {
            double* target = pass.out.data + far + l;
            if (mask == 0xff) (Pack::load(target) + term).store(target);
            else subtract_at(target, bits, -term);
          }
        } else {
          bond.e.store(s.e + lane);
          for (int c = 0; c < D; ++c) bond.n[c].store(s.n[c] + lane);
          if constexpr (rate) {
            bond.along(dw).store(s.de + lane);
            bond.inverse_length.store(s.inverse_length + lane);
          }
          if (!uniform) {
            Pack c = Pack(0.5) * (Pack::load(fields_.modulus.data() + p + l) + Pack::load(fields_.modulus.data() + far + l));
            if (crosses) {
              alignas(64) double of_lane[pack_width];
              c.store(of_lane);
              for (int i = 0; i < pack_width; ++i)
                if (bits >> i & 1) of_lane[i] = fields_.of_bond(static_cast<std::size_t>(p + l + i), static_cast<std::size_t>(far + l + i));
              c = Pack::load(of_lane);
            }
            if (fields_.correction.size() > 0) {
              Pack g(0.0);
              for (int a = 0; a < D; ++a) {
                const double cosine = families_.slots.xi[at][static_cast<std::size_t>(a)] / length_[at * chunk_points];
                const double* G = fields_.correction.component(a);
                g += Pack(0.5 * cosine * cosine) * (Pack::load(G + p + l) + Pack::load(G + far + l));
              }
              c *= g;
            }
            c.store(s.modulus + lane);
          }
        }
      }
    }
    if constexpr (!sums) {
      const int lanes = count * chunk_points;
      law_.bond_law({lanes, length_.data() + slot * chunk_points, omega_.data() + slot * chunk_points, s.e, s.modulus,
                     energies ? s.energy : nullptr, work == PairWork::energy ? nullptr : s.force, work == PairWork::tangent ? s.stiffness : nullptr});
      for (int k = 0; k < count; ++k) {
        const std::size_t at = slot + static_cast<std::size_t>(k);
        const std::int64_t far = p + families_.slots.shifts[at];
        const std::uint8_t mask = pattern.mask[at];
        if (mask == 0) continue;
        for (int v = 0; v < packs; ++v) {
          const int l = v * pack_width, lane = k * chunk_points + l;
          const auto bits = static_cast<std::uint8_t>(mask >> l);
          const Pack b = weakened ? Pack::load(pattern.b_of(at) + l) : Pack(1.0);
          if (screened) {
            Pack value = Pack::load(s.energy + lane);
            if (pass.by_theta)
              value += Pack(omega_[at * chunk_points] * length_[at * chunk_points]) * Pack::load(s.e + lane) *
                       (Pack::load(pass.by_theta + p + l) + Pack::load(pass.by_theta + far + l));
            highest[v] = max(highest[v], keep(bits, value * Pack(pass.screen->over_share ? inverse_share_[at] : 1.0)));
          }
          if (energies) stored[v] += keep(bits, weakened ? b * Pack::load(s.energy + lane) : Pack::load(s.energy + lane));
          if constexpr (work == PairWork::energy) continue;
          Pack t[D], T = Pack::load(s.force + lane);
          const double weight = omega_[at * chunk_points] * length_[at * chunk_points];
          if (dilatation_) T += Pack(weight) * (Pack::load(pass.q.data + p + l) + Pack::load(pass.q.data + far + l));
          if constexpr (work == PairWork::force) {
            T = T * Pack(squared_volume_);
            for (int c = 0; c < D; ++c) t[c] = T * Pack::load(s.n[c] + lane);
          } else {
            // d(T n) = dT n + T (dw - n de)/|y|
            const Pack de = Pack::load(s.de + lane);
            Pack dT = Pack::load(s.stiffness + lane) * de;
            if (dilatation_) dT += Pack(weight) * (Pack::load(pass.dq.data + p + l) + Pack::load(pass.dq.data + far + l));
            const Pack turn = T * Pack::load(s.inverse_length + lane);
            for (int c = 0; c < D; ++c) {
              const Pack dw = keep(bits, Pack::load(pass.w.component(c) + far + l) - own_w[c][v]), n = Pack::load(s.n[c] + lane);
              t[c] = Pack(-squared_volume_) * (dT * n + turn * (dw - n * de));
            }
          }
          for (int c = 0; c < D; ++c) {
            if (weakened) t[c] *= b;
            if (mask != 0xff) t[c] = keep(bits, t[c]);
            own[c][v] += t[c];
            if constexpr (half) {
              double* target = pass.out.component(c) + far + l;
              if (mask == 0xff) (Pack::load(target) - t[c]).store(target);
              else subtract_at(target, bits, t[c]);
            }
          }
        }
      }
    }
  }
  if (screened) {
    bool near = false;
    for (int l = 0; l < chunk_points; ++l)
      near |=
          highest[l / pack_width][l % pack_width] > pass.screen->limit + pass.screen->density[static_cast<std::size_t>(p + l)];
    if (near) pass.screen->near[static_cast<std::size_t>(p) / padding] = 1;
  }
  int bad = -1;
  for (int l = chunk_points - 1; l >= 0; --l)
    if (!finite[l / pack_width][l % pack_width]) bad = l;
  for (int v = 0; v < packs; ++v) {
    const int l = v * pack_width;
    if constexpr (work == PairWork::energy) own[0][v] = Pack(0.5 * families_.volume) * stored[v];
    else if (energies) total += (half ? 1.0 : 0.5) * squared_volume_ * sum(stored[v]);
    for (int c = 0; c < results; ++c) {
      double* target = pass.out.component(c) + p + l;
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
