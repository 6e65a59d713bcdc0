#include <algorithm>

#include "families/cloud/cloud_rows.hpp"
#include "families/lattice/lattice_families.hpp"
#include "families/resting_blocks.hpp"
#include "terms/penalty/zero_energy_penalty.hpp"

namespace perikit {

namespace {

/// The penalty over H_i = sum_k u_ik (x) g_k of any order. With w_k = V_i omega V_k and t_k = w_k M_i z_ik, point i pulls
///
///   at k with -dE_i/du_k = -(t_k - B g_k),   B = sum_l t_l (x) xi_l,
///
/// and at itself with the opposite of their sum. (B = 0 at order 1.)
template <int D>
class StencilPenalty final : public ZeroEnergyPenalty {
  /// What a point, or all points with whole families on a lattice, has in common: by bond, and M.
  struct Stencil {
    std::vector<Row> spring;           ///< {xi, w}
    std::vector<Row> gradient;         ///< g
    Row M[D];                          ///< columns
  };

 public:
  explicit StencilPenalty(const PenaltyParts& parts) : ZeroEnergyPenalty(parts), rows_(parts.families), stencil_(rows_.size(), -1) {
    set_blocks();
    for (std::size_t r = 0; r < rows_.size(); ++r) set_stencil(r);
  }

  void bonds_changed(std::span<const std::int32_t> points) override {
    for (const std::int32_t p : points)
      set_stencil(static_cast<std::size_t>(std::lower_bound(rows_.points().begin(), rows_.points().end(), p) - rows_.points().begin()));
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
    std::size_t total = rows_.bytes() + (stencil_.size() + row_order_.size()) * sizeof(std::int32_t) + (u_.size() + force_.size()) * sizeof(Row);
    for (const Stencil& s : stencils_) total += sizeof(Stencil) + 2 * s.spring.size() * sizeof(Row);
    return total;
  }

 private:
  /// Of row r, as its bonds are now. Whole families of one law share theirs.
  void set_stencil(std::size_t r) {
    const bool shared = rows_.whole(r) && parts_.laws.single();
    if (shared && whole_ >= 0) {
      stencil_[r] = whole_;
      return;
    }
    if (!element_.load(parts_, rows_.point(r))) {
      stencil_[r] = -1;
      return;
    }
    if (stencil_[r] < 0 || stencil_[r] == whole_) {
      stencil_[r] = static_cast<std::int32_t>(stencils_.size());
      stencils_.emplace_back();
    }
    stencils_[static_cast<std::size_t>(stencil_[r])] = keep(element_);
    if (shared) whole_ = stencil_[r];
  }

  static Stencil keep(const PenaltyElement<D>& element) {
    Stencil s;
    for (std::size_t k = 0; k < static_cast<std::size_t>(element.family().bonds); ++k) {
      Row spring{}, gradient{};
      for (int e = 0; e < D; ++e) spring[e] = element.family().xi[e][k], gradient[e] = element.gradient(k, e);
      spring[3] = element.spring(k);
      s.spring.push_back(spring);
      s.gradient.push_back(gradient);
    }
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

  /// t <- t_k by bond; sum_k z_ik . t_k.
  double springs(std::size_t r, std::vector<Row>& t) const {
    const Stencil& s = stencils_[static_cast<std::size_t>(stencil_[r])];
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
      t[k] = Row{};
      for (int b = 0; b < D; ++b) t[k] += s.M[b] * (s.spring[k][3] * z[b]);
      for (int c = 0; c < D; ++c) total += z[c] * t[k][c];
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
    for (std::size_t k = 0; k < family.size(); ++k)
      for (int e = 0; e < D; ++e) B[e] += t[k] * s.spring[k][e];
    for (std::size_t k = 0; k < family.size(); ++k) {
      Row force = t[k];
      for (int e = 0; e < D; ++e) force -= B[e] * s.gradient[k][e];
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
  std::int32_t whole_ = -1;            ///< that of whole families
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
