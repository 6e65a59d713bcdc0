#include <algorithm>
#include <cmath>

#include "families/resting_blocks.hpp"
#include "spaces/cloud/cloud_gradient.hpp"
#include "terms/family_point.hpp"
#include "terms/penalty/penalty_matrix.hpp"
#include "terms/penalty/zero_energy_penalty.hpp"

namespace perikit {

namespace {

/// Two passes over the points: H_i, from it Q_i = M_i H_i (and the energy); then forces, gathered from both ends of each bond.
template <int D, bool isotropic>
class CloudPenalty final : public ZeroEnergyPenalty {
  /// M_i as m_i or as D rows, its columns.
  static constexpr std::size_t columns = isotropic ? 1 : D;
  using Column = std::conditional_t<isotropic, double, Row>;

 public:
  explicit CloudPenalty(const PenaltyParts& parts)
      : ZeroEnergyPenalty(parts),
        families_(*parts.families.cloud()),
        gradient_(families_),
        position_(reinterpret_cast<const Row*>(families_.body().rows().data())),
        points_(families_.body().points()),
        blocks_(families_.body()),
        M_(columns * points_, Column{}),
        flux_(D * points_) {
    if (parts.skip) quiet_ = RestingBlocks(cloud_reach(families_.lists(), blocks_));
    over_points(everywhere, [&](std::size_t p) { set_matrix(p); });
  }

  /// Points beyond `only` have no flux: what was left of them depends on what was evaluated before.
  void apply(ConstFieldView u, double factor, FieldView force, const Region& region, Wanted wanted) override {
    const std::uint8_t *const only = region.only(), *const near = region.near();
    mirror(u);
    if (only) quiet_.wake();
    else quiet_.look(2, [&](std::size_t b) { return blocks_.moves(u, b); });
    const auto wants = [](const std::uint8_t* marks, std::size_t p) { return !marks || marked(marks, p); };
    over_points([&](std::size_t b) { return quiet_.begins(b); },
                [&](std::size_t p) {
                  if (!wants(only, p)) {
                    std::fill_n(&flux_[D * p], D, Row{});
                    return;
                  }
                  gradient_.at(p, u_, &flux_[D * p]);
                  if (wanted.any()) take(p, energy_of_point(p, &flux_[D * p]), wanted);
                  for (std::size_t e = 0; e < D; ++e) flux_[D * p + e] = times(p, flux_[D * p + e]);
                });
    over_points([&](std::size_t b) { return quiet_.awake(b, 2); },
                [&](std::size_t p) {
                  if (!wants(near, p)) return;
                  const Row f = factor * position_[p][3] * force_of_point(p);
                  for (int c = 0; c < D; ++c) force.component(c)[p] += f[c];
                });
  }

  void add_density(ConstFieldView u, double* density, const std::uint8_t* only) override {
    mirror(u);
    quiet_.wake();
    over_points(everywhere, [&](std::size_t p) {
      if (only && !marked(only, p)) return;
      gradient_.at(p, u_, &flux_[D * p]);
      density[p] += energy_of_point(p, &flux_[D * p]) / position_[p][3];
    });
  }

  void bonds_changed(std::span<const std::int32_t> points) override {
    for (const std::int32_t p : points) set_matrix(static_cast<std::size_t>(p));
  }

  std::size_t bytes() const noexcept override { return M_.size() * sizeof(Column) + (flux_.size() + u_.size()) * sizeof(Row); }

 private:
  static constexpr auto everywhere = [](std::size_t) { return true; };

  void mirror(ConstFieldView u) {
    if constexpr (isotropic) mirror_rows(u, points_, u_, M_.data());
    else mirror_rows(u, points_, u_);
  }

  /// body(p) for the points of the blocks with wanted(b).
  template <class Wanted, class Body>
  void over_points(Wanted&& wanted, Body&& body) const {
    parallel_for(blocks_.count(), [&](std::size_t b) {
      if (!wanted(b)) return;
      for (std::size_t p = blocks_.begin(b); p < blocks_.end(b); ++p) body(p);
    });
  }

  void set_matrix(std::size_t p) {
    const double* inverse = families_.inverse_shape(p);
    std::fill_n(&M_[columns * p], columns, Column{});
    if (!penalised(families_.condition(p))) return;  // M = 0
    double intact = 0, M[6];
    for (std::int64_t k = families_.lists().first[p]; k < families_.lists().first[p + 1]; ++k)
      intact += families_.omega(static_cast<std::size_t>(k)) * position_[families_.lists().neighbour[static_cast<std::size_t>(k)]][3];
    parts_.stabilization->penalty(penalty_point(families_, parts_.laws, p, intact, inverse), M);
    if constexpr (isotropic) {
      M_[p] = M[0];
    } else {
      for (int a = 0; a < D; ++a)
        for (int b = 0; b < D; ++b) M_[columns * p + static_cast<std::size_t>(b)][a] = M[symmetric_index(D, a, b)];
    }
  }

  /// M_p x
  Row times(std::size_t p, const Row& x) const noexcept {
    if constexpr (isotropic) {
      return M_[p] * x;
    } else {
      Row y{};
      for (std::size_t e = 0; e < columns; ++e) y += x[static_cast<int>(e)] * M_[columns * p + e];
      return y;
    }
  }

  /// 1/2 V_p sum_j V_j omega z . M_p z, of the columns of H_p.
  double energy_of_point(std::size_t p, const Row* H) const noexcept {
    const Row *const position = position_, *const u = u_.data();
    const TwoRows x = TwoRows::load(position[p], position[p]), own = TwoRows::load(u[p], u[p]);
    TwoRows sum, gradient[D], M[columns];
    for (int e = 0; e < D; ++e) gradient[e] = TwoRows::load(H[e], H[e]);
    for (std::size_t e = 0; e < columns && !isotropic; ++e) M[e] = matrix_rows(p, p, e);
    over_bonds(families_, p, [&](std::size_t j, std::size_t l, const TwoRows& omega) PERIKIT_INLINE {
      const TwoRows far = TwoRows::load(position[j], position[l]), back = x - far;
      TwoRows z = TwoRows::load(u[j], u[l]) - own, t;
      over_components<D>([&](auto e) PERIKIT_INLINE { z.add_product(back.template spread<e>(), gradient[e]); });
      if constexpr (isotropic) t = z;
      else over_components<D>([&](auto e) PERIKIT_INLINE { t.add_product(z.template spread<e>(), M[e]); });
      sum.add_product(omega * far.spread<3>() * z, t);
    });
    const Row products = sum.sum();
    double product = 0;
    for (int c = 0; c < D; ++c) product += products[c];
    if constexpr (isotropic) product *= M_[p];
    return 0.5 * position_[p][3] * product;
  }

  /// sum_j V_j omega [(M_p + M_j) u_pj - (Q_p + Q_j) xi_pj]
  Row force_of_point(std::size_t p) const noexcept {
    const Row *const position = position_, *const u = u_.data(), *const Q = flux_.data();
    const TwoRows x = TwoRows::load(position[p], position[p]), own = TwoRows::load(u[p], u[p]);
    TwoRows f, flux[D], M[columns];
    for (std::size_t e = 0; e < D; ++e) flux[e] = TwoRows::load(Q[D * p + e], Q[D * p + e]);
    for (std::size_t e = 0; e < columns && !isotropic; ++e) M[e] = matrix_rows(p, p, e);
    over_bonds(families_, p, [&](std::size_t j, std::size_t l, const TwoRows& omega) PERIKIT_INLINE {
      const TwoRows far = TwoRows::load(position[j], position[l]), far_u = TwoRows::load(u[j], u[l]);
      const TwoRows back = x - far, du = far_u - own;
      TwoRows t;
      if constexpr (isotropic) t = (far_u + own).template spread<3>() * du;
      else over_components<D>([&](auto e) PERIKIT_INLINE { t.add_product(du.template spread<e>(), M[e] + matrix_rows(j, l, e)); });
      over_components<D>([&](auto e) PERIKIT_INLINE { t.add_product(back.template spread<e>(), flux[e] + TwoRows::load(Q[D * j + e], Q[D * l + e])); });
      f.add_product(omega * far.spread<3>(), t);
    });
    return f.sum();
  }
  /// Column e of M_j and M_l.
  TwoRows matrix_rows(std::size_t j, std::size_t l, std::size_t e) const noexcept {
    if constexpr (isotropic) return TwoRows::fill(M_[j], M_[l]);
    else return TwoRows::load(M_[columns * j + e], M_[columns * l + e]);
  }

  const CloudFamilies& families_;
  CloudGradient<D> gradient_;
  const Row* position_;          ///< {x, y, z, V}
  std::size_t points_;
  CloudBlocks blocks_;
  AlignedVector<Column> M_;
  AlignedVector<Row> u_, flux_;  ///< mirror of u, {u, M} where M is a number; H, then Q, by columns
  RestingBlocks quiet_;
};

}  // namespace

template <int D>
std::unique_ptr<Term> make_cloud_penalty(const PenaltyParts& parts) {
  if (D == 1 || parts.stabilization->traits().isotropic) return std::make_unique<CloudPenalty<D, true>>(parts);
  return std::make_unique<CloudPenalty<D, false>>(parts);
}

template std::unique_ptr<Term> make_cloud_penalty<1>(const PenaltyParts&);
template std::unique_ptr<Term> make_cloud_penalty<2>(const PenaltyParts&);
template std::unique_ptr<Term> make_cloud_penalty<3>(const PenaltyParts&);

}  // namespace perikit
