#include <algorithm>
#include <cmath>

#include "families/lattice/lattice_families.hpp"
#include "families/reproducing_kernel.hpp"
#include "families/resting_blocks.hpp"
#include "perikit/core/parallel.hpp"
#include "spaces/bond_shape.hpp"
#include "terms/penalty/lattice_matrices.hpp"
#include "terms/penalty/zero_energy_penalty.hpp"

namespace perikit {

namespace {

/// The penalty on what the whole fit leaves, on a lattice. With r = sqrt(omega V) of a bond and the orthonormal polynomials phi_a of its family
/// (families/reproducing_kernel.hpp), psi_a = r phi_a,
///
///   c_a = sum_k psi_a(k) r_k u_ik,   r_k z_k = r_k u_ik - sum_a psi_a(k) c_a,   t_k = r_k M (r_k z_k)
///
/// takes two passes over the bonds of eight points side by side. Whole families share r and psi; the others have them for each pattern.
template <int D, bool isotropic>
class LatticeFitPenalty final : public ZeroEnergyPenalty {
  using Matrix = PenaltyMatrix<D, isotropic>;
  static constexpr int packs = chunk_points / pack_width;
  static constexpr std::size_t of_second_order = monomials(D, 2);

 public:
  explicit LatticeFitPenalty(const PenaltyParts& parts)
      : ZeroEnergyPenalty(parts), families_(*parts.families.lattice()), M_(families_.body().make_field(Matrix::components)) {
    if (parts.skip) quiet_ = RestingBlocks(families_.tiles.reach);
    count_ = static_cast<std::size_t>(monomials(D, parts.formulation.order));
    stencils_.assign((families_.patterns.size() + 1) * size(), 0.0);
    std::vector<const LatticeChunk*> example(families_.patterns.size() + 1, nullptr);
    for (const LatticeChunk& chunk : families_.tiles.chunks) example[static_cast<std::size_t>(chunk.pattern + 1)] = &chunk;
    parallel_for(example.size(), [&](std::size_t k) {
      if (example[k]) make(*example[k]);
    });
    parallel_for(families_.tiles.blocks.size(), [&](std::size_t b) { for_chunks(b, [&](const LatticeChunk& chunk) { set_matrices(chunk); }); });
  }

  void apply(ConstFieldView u, double factor, FieldView force, const Region& region, Wanted wanted) override {
    const std::uint8_t* const only = region.only();
    if (only) quiet_.wake();
    else quiet_.look(1, [&](std::size_t b) { return families_.tiles.moves(b, u); });
    families_.tiles.colouring.for_each([&](std::size_t b) {
      if (!quiet_.awake(b, 1)) return;
      for_chunks(b, [&](const LatticeChunk& chunk) {
        if (only && !only[chunk.first / chunk_points]) return;
        double energy[chunk_points] = {};
        pull(chunk, u, factor, &force, wanted.any() ? energy : nullptr);
        for (int l = 0; l < chunk_points; ++l)
          if (energy[l] > 0) take(static_cast<std::size_t>(chunk.first + l), energy[l], wanted);
      });
    });
  }

  void add_density(ConstFieldView u, double* density, const std::uint8_t* only) override {
    parallel_for(families_.tiles.blocks.size(), [&](std::size_t b) {
      for_chunks(b, [&](const LatticeChunk& chunk) {
        if (only && !only[chunk.first / chunk_points]) return;
        double energy[chunk_points] = {};
        pull(chunk, u, 1.0, nullptr, energy);
        for (int l = 0; l < chunk_points; ++l) density[chunk.first + l] += energy[l] / families_.volume;
      });
    });
  }

  void bonds_changed(std::span<const std::int32_t> points) override {
    stencils_.resize((families_.patterns.size() + 1) * size(), 0.0);
    std::int32_t last = -1;
    for (const std::int32_t p : points) {   // ascending
      const std::int32_t index = families_.tiles.chunk_of(p);
      if (index == last) continue;
      last = index;
      const LatticeChunk& chunk = families_.tiles.chunks[static_cast<std::size_t>(index)];
      make(chunk);
      set_matrices(chunk);
    }
  }

  std::size_t bytes() const noexcept override { return stencils_.size() * sizeof(double) + M_.bytes(); }

 private:
  template <class Body>
  void for_chunks(std::size_t b, Body&& body) const {
    for (std::size_t c = families_.tiles.blocks[b].chunk_begin; c < families_.tiles.blocks[b].chunk_end; ++c) body(families_.tiles.chunks[c]);
  }

  /// Of a pattern: [slot][r, psi ...][lane]; whole families without lanes.
  std::size_t size() const noexcept { return families_.slots.size() * (count_ + 1) * chunk_points; }
  std::size_t place(const LatticeChunk& chunk) const noexcept { return static_cast<std::size_t>(chunk.pattern + 1) * size(); }

  void set_matrices(const LatticeChunk& chunk) { set_penalty_matrices<D, isotropic>(parts_, families_, chunk, families_.volume, M_); }

  void make(const LatticeChunk& chunk) {
    const bool whole = chunk.pattern < 0;
    const std::size_t lanes = whole ? 1 : chunk_points, row = count_ + 1;
    double* const stored = stencils_.data() + place(chunk);
    std::fill_n(stored, size(), 0.0);
    FamilyArrays family;
    std::vector<double> gradient, phi;
    for (std::size_t l = 0; l < lanes; ++l) {
      if (!(families_.pattern(chunk).live >> l & 1)) continue;
      const auto p = static_cast<std::size_t>(chunk.first) + l;
      families_.load(p, BondsOf::intact, family);
      const double horizon = families_.body().horizon();
      const std::size_t count = orthonormal_polynomials(family, horizon, point_gradient(family, horizon, parts_.formulation.order, gradient), phi);
      for (std::size_t k = 0; k < family.far.size() && count > 0; ++k) {
        const std::size_t slot = families_.slots.with_shift(family.far[k] - static_cast<std::int64_t>(p));
        const double r = std::sqrt(family.omega[k] * family.volume[k]);
        stored[slot * row * lanes + l] = r;
        for (std::size_t a = 0; a < count; ++a) stored[(slot * row + 1 + a) * lanes + l] = r * phi[k * count + a];
      }
    }
  }

  void pull(const LatticeChunk& chunk, ConstFieldView u, double factor, const FieldView* force, double* energy) const noexcept {
    const bool second = count_ == of_second_order;
    if (chunk.pattern < 0) second ? pull<true, of_second_order>(chunk, u, factor, force, energy) : pull<true, 0>(chunk, u, factor, force, energy);
    else second ? pull<false, of_second_order>(chunk, u, factor, force, energy) : pull<false, 0>(chunk, u, factor, force, energy);
  }

  /// force += -factor dE/du of the points of the chunk, and their energies; null: not wanted. known: how many polynomials there are, 0: count_.
  template <bool whole, std::size_t known>
  void pull(const LatticeChunk& chunk, ConstFieldView u, double factor, const FieldView* force, double* energy) const noexcept {
    const std::size_t count = known > 0 ? known : count_;
    constexpr std::size_t most = known > 0 ? known : most_monomials, lanes = whole ? 1 : chunk_points;
    const LatticePattern& pattern = families_.pattern(chunk);
    const double* const stored = stencils_.data() + place(chunk);
    const std::size_t slots = families_.slots.size();
    const auto value = [](const double* x, int l) {
      if constexpr (whole) return Pack(*x);
      else return Pack::load(x + l);
    };
    Pack own_u[packs][D], c[packs][most][D], M[packs][Matrix::components], own[packs][D], sum[packs];
    for (int i = 0; i < packs; ++i) {
      const int l = i * pack_width;
      const std::int64_t p = chunk.first + l;
      for (int e = 0; e < D; ++e) own_u[i][e] = Pack::load(u.component(e) + p);
      for (int e = 0; e < Matrix::components; ++e) M[i][e] = Pack::load(M_.component(e) + p);
      Pack fit[most][D];
      for (std::size_t a = 0; a < count; ++a)
        for (int e = 0; e < D; ++e) fit[a][e] = Pack(0.0);
      const double* at = stored;
      for (std::size_t s = 0; s < slots; ++s, at += (count + 1) * lanes) {
        const Pack r = value(at, l);
        Pack x[D];
        for (int e = 0; e < D; ++e) x[e] = r * (Pack::load(u.component(e) + p + families_.slots.shifts[s]) - own_u[i][e]);
        for (std::size_t a = 0; a < count; ++a) {
          const Pack psi = value(at + (1 + a) * lanes, l);
          for (int e = 0; e < D; ++e) fit[a][e] += psi * x[e];
        }
      }
      for (std::size_t a = 0; a < count; ++a)
        for (int e = 0; e < D; ++e) c[i][a][e] = fit[a][e];
    }
    // Bond by bond for all eight points, so that what a far end gets comes in the same order whatever the width of a pack is.
    const double* at = stored;
    for (std::size_t s = 0; s < slots; ++s, at += (count + 1) * lanes)
      for (int i = 0; i < packs; ++i) {
        const int l = i * pack_width;
        const std::uint8_t mask = pack_mask(pattern.mask[s], l);
        if (mask == 0) continue;
        const std::int64_t far = chunk.first + l + families_.slots.shifts[s];
        const Pack r = value(at, l);
        Pack z[D], t[D];
        for (int e = 0; e < D; ++e) z[e] = r * (Pack::load(u.component(e) + far) - own_u[i][e]);
        for (std::size_t a = 0; a < count; ++a) {
          const Pack psi = value(at + (1 + a) * lanes, l);
          for (int e = 0; e < D; ++e) z[e] -= psi * c[i][a][e];
        }
        Matrix::apply(M[i], z, t);
        if (energy)
          for (int e = 0; e < D; ++e) sum[i] += z[e] * t[e];
        if (!force) continue;
        const Pack by = Pack(factor) * r;
        for (int e = 0; e < D; ++e) {
          t[e] = by * t[e];
          own[i][e] += t[e];
          add_to_cells(force->component(e) + far, -t[e], mask);
        }
      }
    for (int i = 0; i < packs; ++i) {
      const int l = i * pack_width;
      if (energy) (Pack(0.5) * sum[i]).store(energy + l);
      for (int e = 0; e < D && force; ++e) {
        double* const to = force->component(e) + chunk.first + l;
        (Pack::load(to) + own[i][e]).store(to);
      }
    }
  }

  const LatticeFamilies& families_;
  Field M_;                          ///< V_i M_i
  std::size_t count_ = 0;            ///< polynomials of the order that is asked for
  AlignedVector<double> stencils_;   ///< [whole, patterns ...]
  RestingBlocks quiet_;
};

}  // namespace

template <int D>
std::unique_ptr<Term> make_lattice_fit_penalty(const PenaltyParts& parts) {
  if (D == 1 || parts.stabilization->traits().isotropic) return std::make_unique<LatticeFitPenalty<D, true>>(parts);
  return std::make_unique<LatticeFitPenalty<D, false>>(parts);
}

template std::unique_ptr<Term> make_lattice_fit_penalty<1>(const PenaltyParts&);
template std::unique_ptr<Term> make_lattice_fit_penalty<2>(const PenaltyParts&);
template std::unique_ptr<Term> make_lattice_fit_penalty<3>(const PenaltyParts&);

}  // namespace perikit
