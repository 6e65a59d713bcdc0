#include <algorithm>

#include "families/cloud/cloud_rows.hpp"
#include "families/lattice/lattice_families.hpp"
#include "families/reproducing_kernel.hpp"
#include "families/resting_blocks.hpp"
#include "terms/penalty/zero_energy_penalty.hpp"

namespace perikit {

namespace {

/// The penalty over H_i = sum_k u_ik (x) g_k of any order. With w_k = V_i omega V_k and t_k = w_k M_i z_ik, point i pulls
///
///   at k with -dE_i/du_k = -(t_k - B g_k),   B = sum_l t_l (x) xi_l,
///
/// and at itself with the opposite of their sum. (B = 0 at order 1.) Where the whole fit is subtracted, sum_k t_k phi_a(k) = 0 for each of its
/// polynomials, and t_k is all.
template <int D>
class StencilPenalty final : public ZeroEnergyPenalty {
  /// What points with equal families have in common: by bond, and M.
  struct Stencil {
    std::vector<Row> spring;           ///< {xi, w}
    std::vector<Row> gradient;         ///< g; empty where the whole fit is subtracted
    std::vector<double> polynomial;    ///< then phi_a(k) [k * count + a]
    std::size_t count = 0;
    double volume = 0;                 ///< V_i
    Row M[D];                          ///< columns
  };

 public:
  explicit StencilPenalty(const PenaltyParts& parts) : ZeroEnergyPenalty(parts), rows_(parts.families), stencil_(rows_.size(), -1) {
    set_blocks();
    std::vector<std::int32_t> row_of(rows_.body().stride(), -1);
    for (std::size_t r = 0; r < rows_.size(); ++r) row_of[rows_.point(r)] = static_cast<std::int32_t>(r);
    parts.families.each_class([&](std::span<const std::int32_t> points) {
      std::int32_t shared = -1;
      for (const std::int32_t p : points) {
        const std::int32_t r = row_of[static_cast<std::size_t>(p)];
        if (r < 0) continue;
        if (shared < 0 || !parts_.laws.single()) shared = append(static_cast<std::size_t>(r));
        stencil_[static_cast<std::size_t>(r)] = shared;
        if (shared < 0 && parts_.laws.single()) break;   // none of them has a gradient
      }
    });
    shared_ = stencil_;
  }

  void bonds_changed(std::span<const std::int32_t> points) override {
    for (const std::int32_t p : points)
      renew(static_cast<std::size_t>(std::lower_bound(rows_.points().begin(), rows_.points().end(), p) - rows_.points().begin()));
  }

  void apply(ConstFieldView u, double factor, FieldView force, const Region& region, Wanted wanted) override {
    const std::uint8_t* const only = region.only();
    read(u);
    force_.assign(rows_.size(), Row{});
    energy_.assign(wanted.any() ? rows_.size() : 0, 0.0);
    if (only) quiet_.wake();
    else quiet_.look(1, [&](std::size_t b) {
      bool any = false;
      over_rows(b, [&](std::size_t r) { for (int c = 0; c < D; ++c) any |= u_[r][c] != 0; });
      return any;
    });
    colouring_->for_each([&](std::size_t b) {
      if (!quiet_.awake(b, 1)) return;
      std::vector<Row> t;
      over_rows(b, [&](std::size_t r) {
        if (only && !marked(only, rows_.point(r))) return;
        const double twice = pull(r, factor, t);
        if (wanted.any()) energy_[r] = 0.5 * twice;
      });
    });
    for (std::size_t r = 0; r < rows_.size(); ++r)
      for (int c = 0; c < D; ++c) force.component(c)[rows_.point(r)] += force_[r][c];
    // Blocks may share a group.
    for (std::size_t r = 0; r < energy_.size(); ++r) take(rows_.point(r), energy_[r], wanted);
  }

  void add_density(ConstFieldView u, double* density, const std::uint8_t* only) override {
    read(u);
    parallel_for(blocks(), [&](std::size_t b) {
      std::vector<Row> t;
      over_rows(b, [&](std::size_t r) {
        if (stencil_[r] >= 0 && (!only || marked(only, rows_.point(r)))) density[rows_.point(r)] += 0.5 * springs(r, t) / rows_.volume(r);
      });
    });
  }

  std::size_t bytes() const noexcept override {
    std::size_t total = rows_.bytes() + (stencil_.size() + shared_.size() + own_.size() + row_order_.size()) * sizeof(std::int32_t) + (u_.size() + force_.size()) * sizeof(Row);
    for (const Stencil& s : stencils_) total += sizeof(Stencil) + (s.spring.size() + s.gradient.size()) * sizeof(Row) + s.polynomial.size() * sizeof(double);
    return total;
  }

 private:
  /// Adds the stencil of row r, as its bonds are now; -1 where it has no gradient.
  std::int32_t append(std::size_t r) {
    if (!element_.load(parts_, rows_.point(r))) return -1;
    stencils_.push_back(keep(element_));
    return static_cast<std::int32_t>(stencils_.size()) - 1;
  }

  /// Of a row whose bonds have changed: families that are as at the set-up have what they had then, others one of their own.
  void renew(std::size_t r) {
    stencil_[r] = shared_[r];
    if (!parts_.families.lost_bonds(rows_.point(r))) return;
    own_.resize(rows_.size(), -1);
    if (own_[r] < 0) {
      stencil_[r] = own_[r] = append(r);
    } else if (element_.load(parts_, rows_.point(r))) {
      stencils_[static_cast<std::size_t>(own_[r])] = keep(element_);
      stencil_[r] = own_[r];
    } else {
      stencil_[r] = -1;
    }
  }

  static Stencil keep(const PenaltyElement<D>& element) {
    Stencil s;
    for (std::size_t k = 0; k < static_cast<std::size_t>(element.family().bonds); ++k) {
      Row spring{}, gradient{};
      for (int e = 0; e < D; ++e) spring[e] = element.family().xi[e][k], gradient[e] = element.gradient(k, e);
      spring[3] = element.spring(k);
      s.spring.push_back(spring);
      if (element.polynomials() == 0) s.gradient.push_back(gradient);
      for (std::size_t a = 0; a < element.polynomials(); ++a) s.polynomial.push_back(element.polynomial(k, a));
    }
    s.count = element.polynomials();
    s.volume = element.owner_volume();
    for (int b = 0; b < D; ++b) {
      s.M[b] = Row{};
      for (int a = 0; a < D; ++a) s.M[b][a] = element.matrix(a, b);
    }
    return s;
  }

  void read(ConstFieldView u) {
    u_.resize(rows_.size());
    for (std::size_t r = 0; r < rows_.size(); ++r) {
      u_[r] = Row{};
      for (int c = 0; c < D; ++c) u_[r][c] = u.component(c)[rows_.point(r)];
    }
  }

  /// Blocks are those that the body has on any number of ranks: tiles of a lattice, pieces of the curve of a cloud.
  void set_blocks() {
    BlockReach reach;
    if (const LatticeFamilies* lattice = parts_.families.lattice()) {
      const LatticeTiles& tiles = lattice->tiles;
      std::vector<std::int32_t> row_of(rows_.body().stride(), -1);
      for (std::size_t r = 0; r < rows_.size(); ++r) row_of[rows_.point(r)] = static_cast<std::int32_t>(r);
      for (const LatticeBlock& block : tiles.blocks) {
        for (std::size_t c = block.chunk_begin; c < block.chunk_end; ++c)
          for (int l = 0; l < chunk_points; ++l)
            if (const std::int32_t r = row_of[static_cast<std::size_t>(tiles.chunks[c].first + l)]; r >= 0) row_order_.push_back(r);
        block_end_.push_back(row_order_.size());
      }
      reach = tiles.reach;
      colouring_ = &tiles.colouring;
    } else {
      for (std::size_t r = 0; r < rows_.size(); ++r) row_order_.push_back(static_cast<std::int32_t>(r));
      const CloudBlocks blocks(rows_.size(), rows_.body().block_points());
      for (std::size_t b = 0; b < blocks.count(); ++b) block_end_.push_back(blocks.end(b));
      reach = cloud_reach(rows_.lists(), blocks);
      of_cloud_ = cloud_colouring(rows_.body(), rows_.lists(), blocks, reach);
    }
    if (parts_.skip) quiet_ = RestingBlocks(std::move(reach));
  }

  std::size_t blocks() const noexcept { return block_end_.size(); }
  template <class Use>
  void over_rows(std::size_t b, Use&& use) const {
    for (std::size_t k = b == 0 ? 0 : block_end_[b - 1]; k < block_end_[b]; ++k) use(static_cast<std::size_t>(row_order_[k]));
  }

  /// t_k of z, and z . t_k.
  static Row spring(const Stencil& s, std::size_t k, const Row& z, double& work) {
    Row t{};
    for (int b = 0; b < D; ++b) t += s.M[b] * (s.spring[k][3] * z[b]);
    for (int c = 0; c < D; ++c) work += z[c] * t[c];
    return t;
  }

  /// t <- t_k by bond, of what the whole fit leaves; sum_k z_ik . t_k.
  double springs_of_fit(std::size_t r, std::vector<Row>& t) const {
    const Stencil& s = stencils_[static_cast<std::size_t>(stencil_[r])];
    const auto family = rows_.neighbours(r);
    Row fit[most_monomials];
    std::fill_n(fit, s.count, Row{});
    t.resize(family.size());
    const double* phi = s.polynomial.data();
    for (std::size_t k = 0; k < family.size(); ++k, phi += s.count) {
      t[k] = u_[static_cast<std::size_t>(family[k])] - u_[r];
      const Row weighed = t[k] * (s.spring[k][3] / s.volume);
      for (std::size_t a = 0; a < s.count; ++a) fit[a] += weighed * phi[a];
    }
    double total = 0;
    phi = s.polynomial.data();
    for (std::size_t k = 0; k < family.size(); ++k, phi += s.count) {
      Row z = t[k];
      for (std::size_t a = 0; a < s.count; ++a) z -= fit[a] * phi[a];
      t[k] = spring(s, k, z, total);
    }
    return total;
  }

  /// t <- t_k by bond; sum_k z_ik . t_k.
  double springs(std::size_t r, std::vector<Row>& t) const {
    const Stencil& s = stencils_[static_cast<std::size_t>(stencil_[r])];
    if (s.count > 0) return springs_of_fit(r, t);
    const auto family = rows_.neighbours(r);
    Row H[D] = {};  // columns
    for (std::size_t k = 0; k < family.size(); ++k) {
      const Row difference = u_[static_cast<std::size_t>(family[k])] - u_[r];
      for (int e = 0; e < D; ++e) H[e] += difference * s.gradient[k][e];
    }
    double total = 0;
    t.resize(family.size());
    for (std::size_t k = 0; k < family.size(); ++k) {
      Row z = u_[static_cast<std::size_t>(family[k])] - u_[r];
      for (int e = 0; e < D; ++e) z -= H[e] * s.spring[k][e];
      t[k] = spring(s, k, z, total);
    }
    return total;
  }

  /// Adds the forces of row r; sum_k z_ik . t_k.
  double pull(std::size_t r, double factor, std::vector<Row>& t) {
    if (stencil_[r] < 0) return 0;
    const double total = springs(r, t);
    const Stencil& s = stencils_[static_cast<std::size_t>(stencil_[r])];
    const auto family = rows_.neighbours(r);
    Row B[D] = {};  // columns
    const bool linear = s.count == 0;
    for (std::size_t k = 0; k < family.size() && linear; ++k)
      for (int e = 0; e < D; ++e) B[e] += t[k] * s.spring[k][e];
    for (std::size_t k = 0; k < family.size(); ++k) {
      Row force = t[k];
      for (int e = 0; e < D && linear; ++e) force -= B[e] * s.gradient[k][e];
      force *= factor;
      force_[static_cast<std::size_t>(family[k])] -= force;
      force_[r] += force;
    }
    return total;
  }

  BlockRows rows_;
  PenaltyElement<D> element_;
  std::vector<std::int32_t> row_order_;  ///< block by block
  std::vector<std::size_t> block_end_;   ///< into row_order_
  Colouring of_cloud_;
  const Colouring* colouring_ = &of_cloud_;   ///< or that of a lattice
  RestingBlocks quiet_;
  std::vector<std::int32_t> stencil_;  ///< by row: which stencil, -1 without a gradient
  std::vector<Stencil> stencils_;
  std::vector<std::int32_t> shared_;   ///< likewise, at the set-up
  std::vector<std::int32_t> own_;      ///< that of a row whose bonds have failed, -1 where none has yet; empty before any has
  AlignedVector<Row> u_, force_;       ///< by row
  std::vector<double> energy_;         ///< likewise, where it is wanted
};

}  // namespace

template <int D>
std::unique_ptr<Term> make_stencil_penalty(const PenaltyParts& parts) {
  return std::make_unique<StencilPenalty<D>>(parts);
}

template std::unique_ptr<Term> make_stencil_penalty<1>(const PenaltyParts&);
template std::unique_ptr<Term> make_stencil_penalty<2>(const PenaltyParts&);
template std::unique_ptr<Term> make_stencil_penalty<3>(const PenaltyParts&);

}  // namespace perikit
