#include <numeric>

#include "families/cloud_rows.hpp"
#include "assembly/penalty_element.hpp"
#include "families/quiet_blocks.hpp"
#include "terms/zero_energy_penalty.hpp"

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
  explicit StencilPenalty(const ModelParts& parts)
      : families_(*parts.body, *parts.influence, parts.formulation.weight), stencil_(families_.rows(), -1) {
    const BlockReach reach = cloud_reach(families_.lists(), families_.rows());
    colouring_ = Colouring(reach);
    if (parts.skip) quiet_ = QuietBlocks(reach);
    PenaltyElement<D> element;
    const bool same_law = parts.laws->single();
    std::int32_t whole = -1;
    for (std::size_t r = 0; r < families_.rows(); ++r) {
      const bool shared = families_.whole(r) && same_law;
      if (shared && whole >= 0) {
        stencil_[r] = whole;
      } else if (element.load(parts, families_, r)) {
        stencil_[r] = static_cast<std::int32_t>(stencils_.size());
        stencils_.push_back(keep(element));
        if (shared) whole = stencil_[r];
      }
    }
  }

  void add_forces(ConstFieldView u, double factor, FieldView force, double* energy) override {
    read(u);
    force_.assign(families_.rows(), Row{});
    std::vector<double> energies(cloud_blocks(families_.rows()), 0.0);
    quiet_.look(1, [&](std::size_t b) {
      bool any = false;
      over_rows(b, [&](std::size_t r) { for (int c = 0; c < D; ++c) any |= u_[r][c] != 0; });
      return any;
    });
    colouring_.for_each([&](std::size_t b) {
      if (!quiet_.awake(b, 1)) return;
      std::vector<Row> t;
      over_rows(b, [&](std::size_t r) { energies[b] += 0.5 * pull(r, factor, t); });
    });
    for (std::size_t r = 0; r < families_.rows(); ++r)
      for (int c = 0; c < D; ++c) force.component(c)[families_.point(r)] += force_[r][c];
    if (energy) *energy += std::accumulate(energies.begin(), energies.end(), 0.0);
  }

  void add_density(ConstFieldView u, double* density) override {
    read(u);
    parallel_for(cloud_blocks(families_.rows()), [&](std::size_t b) {
      std::vector<Row> t;
      over_rows(b, [&](std::size_t r) {
        if (stencil_[r] >= 0) density[families_.point(r)] += 0.5 * springs(r, t) / families_.volume(r);
      });
    });
  }

  std::size_t bytes() const noexcept override {
    std::size_t total = families_.bytes() + stencil_.size() * sizeof(std::int32_t) + (u_.size() + force_.size()) * sizeof(Row);
    for (const Stencil& s : stencils_) total += sizeof(Stencil) + 2 * s.spring.size() * sizeof(Row);
    return total;
  }
  bool simple_force() const noexcept override { return false; }
  double energy_of(ConstFieldView, const GroupMarks&) override { return 0; }
  void bonds_changed(std::span<const std::int32_t>) override {}

 private:
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
    u_.resize(families_.rows());
    for (std::size_t r = 0; r < families_.rows(); ++r) {
      u_[r] = Row{};
      for (int c = 0; c < D; ++c) u_[r][c] = u.component(c)[families_.point(r)];
    }
  }

  template <class Use>
  void over_rows(std::size_t b, Use&& use) const {
    for (std::size_t r = b * cloud_block_points; r < std::min(families_.rows(), (b + 1) * cloud_block_points); ++r) use(r);
  }

  /// t <- t_k by bond; sum_k z_ik . t_k.
  double springs(std::size_t r, std::vector<Row>& t) const {
    const Stencil& s = stencils_[static_cast<std::size_t>(stencil_[r])];
    const auto family = families_.neighbours(r);
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
    const auto family = families_.neighbours(r);
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

  PointFamilies families_;
  Colouring colouring_;
  QuietBlocks quiet_;
  std::vector<std::int32_t> stencil_;  ///< by row: which stencil, -1 without a gradient
  std::vector<Stencil> stencils_;
  AlignedVector<Row> u_, force_;       ///< by row
};

}  // namespace

template <int D>
std::unique_ptr<ZeroEnergyPenalty> make_stencil_penalty(const ModelParts& parts) {
  return std::make_unique<StencilPenalty<D>>(parts);
}

template std::unique_ptr<ZeroEnergyPenalty> make_stencil_penalty<1>(const ModelParts&);
template std::unique_ptr<ZeroEnergyPenalty> make_stencil_penalty<2>(const ModelParts&);
template std::unique_ptr<ZeroEnergyPenalty> make_stencil_penalty<3>(const ModelParts&);

}  // namespace perikit
