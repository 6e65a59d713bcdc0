#include <algorithm>
#include <functional>

#include "families/lattice/lattice_families.hpp"
#include "families/resting_blocks.hpp"
#include "spaces/lattice/lattice_gradient.hpp"
#include "spaces/lattice/work_of_groups.hpp"
#include "terms/penalty/lattice_matrices.hpp"
#include "terms/penalty/zero_energy_penalty.hpp"

namespace perikit {

namespace {

/// On a lattice V_j M_i = V M_i, called M here, and the sums over bonds are those of the point gradient and its divergence:
///
///   f_k = M_k sum_s omega_s u_{k+s} - B_k u_k  +  sum_s omega_s v_{k+s}  +  (divergence of Q)_k
///   v = M u,   Q = -spacing M H,   B_k = sum_s omega_s (M_k + M_{k+s})
///
/// The energy is summed bond by bond: this sum of large terms that cancel would leave none of its digits near affine motions.
template <int D, bool isotropic>
class LatticePenalty final : public ZeroEnergyPenalty {
  using Matrix = PenaltyMatrix<D, isotropic>;

 public:
  explicit LatticePenalty(const PenaltyParts& parts)
      : ZeroEnergyPenalty(parts),
        families_(*parts.families.lattice()),
        operator_(families_),
        M_(families_.body().make_field(Matrix::components)),
        B_(families_.body().make_field(Matrix::components)),
        flux_(families_.body().make_field(D * D)),
        source_(families_.body().make_field(D)) {
    if (parts.skip) quiet_ = RestingBlocks(families_.tiles.reach);
    if (families_.body().part()) felt_rows_ = felt_rows(families_, affects_owned_points(families_));
    const std::size_t blocks = families_.tiles.blocks.size();
    parallel_for(blocks, [&](std::size_t b) { for_chunks(b, [&](const LatticeChunk& chunk) { set_matrices(chunk); }); });
    parallel_for(blocks, [&](std::size_t b) { for_chunks(b, [&](const LatticeChunk& chunk) { set_sums(chunk); }); });
  }

  /// Points of `near` in rows without sources feel those of `only` as well: sources send M_i u_i, and -M_i u_k stands in B_k u_k.
  void apply(ConstFieldView u, double factor, FieldView force, const Region& region, Wanted wanted) override {
    const std::uint8_t *const only = region.only(), *const near = region.near();
    if (only) quiet_.wake();
    else quiet_.look(2, [&](std::size_t b) { return families_.tiles.moves(b, u); });
    parallel_for(families_.tiles.blocks.size(), [&](std::size_t b) {
      if (!quiet_.begins(b)) return;
      for_gradients(b, u, only, [&](const LatticeChunk& chunk, const double* H, const double* sums) {
        own_forces(chunk, u, factor, H, sums, force);
        if (!wanted.any()) return;
        double of_points[chunk_points];
        energies_of_points(chunk, u, H, of_points);
        for (int l = 0; l < chunk_points; ++l)
          if (of_points[l] > 0) take(static_cast<std::size_t>(chunk.first + l), of_points[l], wanted);
      });
    });
    families_.tiles.colouring.for_each([&](std::size_t b) {
      if (!quiet_.awake(b, 2)) return;
      for (std::size_t r = families_.tiles.blocks[b].row_begin; r < families_.tiles.blocks[b].row_end; ++r)
        if (takes(r, only)) operator_.divergence(families_.tiles.rows[r], flux_, source_, force);
        else if (only) hold(families_.tiles.rows[r], u, factor, near, force);
      if (!families_.any_broken()) return;
      for_chunks(b, [&](const LatticeChunk& chunk) {
        if (!only || only[chunk.first / chunk_points]) operator_.remove_broken(chunk, flux_, chunk.first, source_, force);
      });
    });
    families_.tiles.clear_dead(force);
  }

  void add_density(ConstFieldView u, double* density, const std::uint8_t* only) override {
    parallel_for(families_.tiles.blocks.size(), [&](std::size_t b) {
      for_gradients(b, u, only, [&](const LatticeChunk& chunk, const double* H, const double*) {
        double of_points[chunk_points];
        energies_of_points(chunk, u, H, of_points);
        for (int l = 0; l < chunk_points; ++l) density[chunk.first + l] += of_points[l] / families_.volume;
      });
    });
  }

  void bonds_changed(std::span<const std::int32_t> points) override {
    // B of a point depends on M of its family.
    GroupMarks changed(families_.body().stride() / padding, 0), near = changed;
    for (const std::int32_t p : points) {
      changed[static_cast<std::size_t>(p) / padding] = near[static_cast<std::size_t>(p) / padding] = whole_group;
      for (const std::int64_t shift : families_.slots.shifts) near[static_cast<std::size_t>(p + shift) / padding] = whole_group;
    }
    const auto over = [&](const GroupMarks& marks, auto&& set) {
      for (const LatticeChunk& chunk : families_.tiles.chunks)
        if (marks[static_cast<std::size_t>(chunk.first) / padding]) set(chunk);
    };
    over(changed, [&](const LatticeChunk& chunk) { set_matrices(chunk); });
    over(near, [&](const LatticeChunk& chunk) { set_sums(chunk); });
  }

  std::size_t bytes() const noexcept override { return M_.bytes() + B_.bytes() + flux_.bytes() + source_.bytes(); }

 private:
  template <class Body>
  void for_chunks(std::size_t b, Body&& body) const {
    for (std::size_t c = families_.tiles.blocks[b].chunk_begin; c < families_.tiles.blocks[b].chunk_end; ++c)
      body(families_.tiles.chunks[c]);
  }

  void set_matrices(const LatticeChunk& chunk) {
    set_penalty_matrices<D, isotropic>(parts_, families_, chunk, families_.volume * families_.volume, M_);
  }

  void set_sums(const LatticeChunk& chunk) {
    const LatticePattern& pattern = families_.pattern(chunk);
    for (int l = 0; l < chunk_points; l += pack_width)
      for (int c = 0; c < Matrix::components; ++c) {
        const double* M = M_.component(c) + chunk.first + l;
        Pack sum(0.0);
        for (std::size_t s = 0; s < families_.slots.offsets.size(); ++s) {
          sum += Pack::load(pattern.b_of(s) + l) * Pack(families_.slots.omega[s]) *
                 (Pack::load(M) + Pack::load(M + families_.slots.shifts[s]));
        }
        sum.store(B_.component(c) + chunk.first + l);
      }
  }

  static std::uint8_t lanes(const LatticePattern& pattern, std::size_t slot, int l) noexcept {
    return static_cast<std::uint8_t>(pattern.mask[slot] >> l);
  }
  /// Component of H beside internal axis e.
  std::size_t component(int c, int e) const noexcept {
    return static_cast<std::size_t>(c * D + families_.grid.axis[static_cast<std::size_t>(e)]);
  }

  /// Whether somebody feels a row, and a group of it or one that its points read along the row is marked.
  bool takes(std::size_t row, const std::uint8_t* only) const noexcept {
    if (!felt_rows_.empty() && !felt_rows_[row]) return false;
    const LatticeRow& r = families_.tiles.rows[row];
    const std::int32_t group = r.first / chunk_points;
    return !only || std::any_of(only + group - r.before, only + group + r.chunks + r.after, [](std::uint8_t marked) { return marked != 0; });
  }

  /// use(chunk, H of its lanes, sum_s omega_s u_{k+s} of its lanes), both with stride batch_points, for every chunk of the wanted
  /// rows of block b: whole rows, since the divergence reads these, and no others, since a rank may have a part of the block.
  template <class Use>
  void for_gradients(std::size_t b, ConstFieldView u, const std::uint8_t* only, Use&& use) const {
    alignas(64) double H[D * D * batch_points], sums[D * batch_points];
    constexpr std::size_t at_once = batch_points / chunk_points;
    std::size_t row = families_.tiles.blocks[b].row_begin;
    for (std::size_t c = families_.tiles.blocks[b].chunk_begin; c < families_.tiles.blocks[b].chunk_end; c += at_once) {
      const std::size_t n = std::min(at_once, families_.tiles.blocks[b].chunk_end - c);
      bool taken[at_once];
      for (std::size_t k = 0; k < n; ++k) {
        while (!families_.tiles.rows[row].holds(families_.tiles.chunks[c + k].first)) ++row;
        taken[k] = takes(row, only);
      }
      if (std::none_of(taken, taken + n, std::identity())) continue;
      operator_.gradient_and_sums(&families_.tiles.chunks[c], static_cast<int>(n), u, H, sums, batch_points);
      for (std::size_t k = 0; k < n; ++k)
        if (taken[k]) use(families_.tiles.chunks[c + k], H + k * chunk_points, sums + k * chunk_points);
    }
  }

  /// Flux, source, and what they and the point's own displacement give its own force.
  void own_forces(const LatticeChunk& chunk, ConstFieldView u, double factor, const double* H, const double* sums,
                  FieldView force) noexcept {
    const LatticePattern& pattern = families_.pattern(chunk);
    const Pack scale(factor), flux_scale(-factor * families_.spacing);
    for (int l = 0; l < chunk_points; l += pack_width) {
      const std::int64_t p = chunk.first + l;
      Pack M[Matrix::components], B[Matrix::components], x[D], near[D], f[D], y[D];
      for (int c = 0; c < Matrix::components; ++c) {
        M[c] = Pack::load(M_.component(c) + p);
        B[c] = Pack::load(B_.component(c) + p);
      }
      for (int c = 0; c < D; ++c) {
        x[c] = Pack::load(u.component(c) + p);
        near[c] = Pack::load(sums + c * batch_points + l);
      }
      Matrix::apply(M, near, f);
      Matrix::apply(B, x, y);
      for (int c = 0; c < D; ++c) f[c] = scale * (f[c] - y[c]);
      Matrix::apply(M, x, y);
      for (int c = 0; c < D; ++c) (scale * y[c]).store(source_.component(c) + p);
      for (int e = 0; e < D; ++e) {
        const Pack moment = Pack::load(pattern.moment[e] + l);
        for (int c = 0; c < D; ++c) x[c] = Pack::load(H + component(c, e) * batch_points + l);
        Matrix::apply(M, x, y);
        for (int c = 0; c < D; ++c) {
          const Pack q = flux_scale * y[c];
          q.store(flux_.component(c * D + e) + p);
          f[c] += q * moment;
        }
      }
      for (int c = 0; c < D; ++c) (Pack::load(force.component(c) + p) + f[c]).store(force.component(c) + p);
    }
  }

  /// force -= factor B u on the points of a row in the groups of `near`.
  void hold(const LatticeRow& row, ConstFieldView u, double factor, const std::uint8_t* near, FieldView force) const noexcept {
    for (int k = 0; k < row.chunks * chunk_points; k += pack_width) {
      const std::int64_t p = row.first + k;
      if (!near[p / chunk_points]) continue;
      Pack B[Matrix::components], x[D], y[D];
      for (int c = 0; c < Matrix::components; ++c) B[c] = Pack::load(B_.component(c) + p);
      for (int c = 0; c < D; ++c) x[c] = Pack::load(u.component(c) + p);
      Matrix::apply(B, x, y);
      for (int c = 0; c < D; ++c) (Pack::load(force.component(c) + p) - Pack(factor) * y[c]).store(force.component(c) + p);
    }
  }

  /// 1/2 sum_s omega_s z . M z of the lanes of one chunk.
  void energies_of_points(const LatticeChunk& chunk, ConstFieldView u, const double* H, double* energy) const noexcept {
    const LatticePattern& pattern = families_.pattern(chunk);
    for (int l = 0; l < chunk_points; l += pack_width) {
      const std::int64_t p = chunk.first + l;
      Pack M[Matrix::components], G[D][D], own[D], sum(0.0);
      for (int c = 0; c < Matrix::components; ++c) M[c] = Pack::load(M_.component(c) + p);
      for (int c = 0; c < D; ++c) {
        own[c] = Pack::load(u.component(c) + p);
        for (int e = 0; e < D; ++e) G[c][e] = Pack(families_.spacing) * Pack::load(H + component(c, e) * batch_points + l);
      }
      for (std::size_t s = 0; s < families_.slots.offsets.size(); ++s) {
        Pack z[D], t[D], product(0.0);
        for (int c = 0; c < D; ++c) {
          z[c] = Pack::load(u.component(c) + p + families_.slots.shifts[s]) - own[c];
          for (int e = 0; e < D; ++e) z[c] -= G[c][e] * Pack(families_.slots.offsets[s][static_cast<std::size_t>(e)]);
        }
        Matrix::apply(M, z, t);
        for (int c = 0; c < D; ++c) product += z[c] * t[c];
        sum += keep(lanes(pattern, s, l), Pack::load(pattern.b_of(s) + l) * Pack(0.5 * families_.slots.omega[s]) * product);
      }
      sum.store(energy + l);
    }
  }

  const LatticeFamilies& families_;
  LatticeOperator<D> operator_;
  Field M_, B_;
  Field flux_, source_;  ///< Q, v
  std::vector<std::uint8_t> felt_rows_;  ///< of one of several ranks; empty: all are
  RestingBlocks quiet_;
};

}  // namespace

template <int D>
std::unique_ptr<Term> make_lattice_penalty(const PenaltyParts& parts) {
  if (D == 1 || parts.stabilization->traits().isotropic) return std::make_unique<LatticePenalty<D, true>>(parts);
  return std::make_unique<LatticePenalty<D, false>>(parts);
}

template std::unique_ptr<Term> make_lattice_penalty<1>(const PenaltyParts&);
template std::unique_ptr<Term> make_lattice_penalty<2>(const PenaltyParts&);
template std::unique_ptr<Term> make_lattice_penalty<3>(const PenaltyParts&);

}  // namespace perikit
