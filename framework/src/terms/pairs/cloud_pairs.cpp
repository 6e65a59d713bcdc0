/// Pair laws on a cloud: one point at a time over its sorted neighbours, those with a larger index only (the force at the far
/// end is the opposite one). Bond vectors and lengths are recomputed from positions.

#include <algorithm>
#include <cmath>
#include <limits>

#include "families/cloud/cloud_families.hpp"
#include "families/cloud/cloud_row_simd.hpp"
#include "terms/pairs/pair_energy_shares.hpp"
#include "terms/pairs/pair_loop.hpp"

namespace perikit {

namespace {

template <int D>
class CloudPairs final : public PairLoop {
 public:
  explicit CloudPairs(const PairLoopParts& parts);

  const NearestFailure* watch(double least_onset) override {
    nearest_.least_onset = least_onset;
    fails_ = true;
    return &nearest_;
  }
  std::size_t blocks() const noexcept override { return blocks_.count(); }
  std::size_t bytes() const noexcept override {
    return upper_.size() * sizeof(std::int64_t) + nearest_.excess.size() * sizeof(double) + (u_.size() + w_.size() + force_.size()) * sizeof(Row);
  }
  std::int64_t run(const PairPass& pass) override;

 private:
  struct Gathered {
    alignas(64) double xi[3][batch_points];
    alignas(64) double du[3][batch_points];
    alignas(64) double dw[3][batch_points];
    alignas(64) double length[batch_points];
    alignas(64) double omega[batch_points];
    alignas(64) double weight[batch_points];   ///< omega |xi|, times f where factors are of the dilatation
    alignas(64) double q[batch_points];        ///< q_i + q_j
    alignas(64) double dq[batch_points];
    alignas(64) double own_strain[batch_points], far_strain[batch_points];   ///< see PairFields::own_strain; near interfaces
    alignas(64) double far_volume[batch_points];   ///< b V_j
    alignas(64) double integrity[batch_points];    ///< b, where bonds may have weakened
    alignas(64) double t[batch_points];        ///< omega |xi| e or its rate
    std::int32_t far[batch_points];
  };

  template <PairWork work>
  void run_block(std::size_t b, const PairPass& pass);
  /// Whether all bonds of the point had a finite positive length.
  template <PairWork work>
  bool run_point(std::size_t p, const PairPass& pass, double& energy);
  void moduli(std::size_t p, const std::int32_t* neighbour, int n, const Gathered& g, double* out) const noexcept;
  template <PairWork work>
  void gather(std::size_t p, std::int64_t begin, int n, Gathered& g, PairScratch& s) const noexcept;

  const CloudFamilies& families_;
  const FamilyLists& lists_;
  const PairKinematics& law_;
  const PairFields& fields_;
  bool dilatation_;
  bool fails_ = false;
  std::size_t points_;
  CloudBlocks blocks_;
  const Row* position_;                        ///< {x, y, z, V}
  std::vector<std::int64_t> upper_;            ///< first neighbour with a larger index
  NearestFailure nearest_;                     ///< only where damage is on
  Colouring colouring_;
  ArrivingPieces pieces_;
  AlignedVector<Row> u_, w_;                   ///< {u, q} and {w, dq}
  const double* factors_;                      ///< f by bond; null: 1
  AlignedVector<Row> force_;
};

template <int D>
CloudPairs<D>::CloudPairs(const PairLoopParts& parts)
    : PairLoop(parts), families_(*parts.families.cloud()), lists_(families_.lists()), law_(*parts.formulation.pairs), fields_(parts.fields),
      dilatation_(parts.formulation.dilatation != nullptr), points_(families_.body().points()), blocks_(families_.body()),
      position_(reinterpret_cast<const Row*>(families_.body().rows().data())), upper_(points_), pieces_(families_.body()),
      factors_(fields_.factors->by_bond.empty() ? nullptr : fields_.factors->by_bond.data()), force_(points_) {
  for (std::size_t p = 0; p < points_; ++p) upper_[p] = families_.index(static_cast<std::int32_t>(p), static_cast<std::int32_t>(p));
  const BlockReach reach = cloud_reach(families_.body(), lists_);
  colouring_ = cloud_colouring(families_.body(), lists_, blocks_, reach);
  if (parts.quiet) watch_waves(reach);
}

/// c_ij of n bonds without their factors: the mean of both ends.
template <int D>
void CloudPairs<D>::moduli(std::size_t p, const std::int32_t* neighbour, int n, const Gathered& g, double* out) const noexcept {
  if (fields_.modulus.size() == 0) {
    std::fill_n(out, n, fields_.uniform);
    return;
  }
  const double* const modulus = fields_.modulus.data();
  const Pack own(modulus[p]);
  for (int l = 0; l < n; l += pack_width) (Pack(0.5) * (own + perikit::gather(modulus, g.far + l))).store(out + l);
  for (int l = 0; l < n && fields_.crosses(p); ++l) out[l] = fields_.of_bond(p, static_cast<std::size_t>(neighbour[l]));
}

template <int D>
template <PairWork work>
void CloudPairs<D>::gather(std::size_t p, std::int64_t begin, int n, Gathered& g, PairScratch& s) const noexcept {
  constexpr bool sums = work == PairWork::dilatation || work == PairWork::dilatation_rate;
  constexpr bool rate = work == PairWork::dilatation_rate || work == PairWork::tangent;
  // One loop for what every bond has, and one for each thing more: each is short enough to stay in registers. Lanes beyond the last bond are the
  // first one again, at rest and without volume.
  const Row *const position = position_, *const u = u_.data(), x = position[p], own = u[p];
  const std::int32_t* const neighbour = lists_.neighbour.data() + begin;
  std::copy_n(neighbour, n, g.far);
  std::fill(g.far + n, g.far + padded(static_cast<std::size_t>(n)), neighbour[0]);
  for (int l = 0; l < n; l += pack_width) {
    const std::uint8_t real = first_lanes(n - l);
    const RowColumns far = RowColumns::load(position, g.far + l), far_u = RowColumns::load(u, g.far + l);
    Pack square(0.0);
    for (int c = 0; c < D; ++c) {
      const Pack xi = far[c] - Pack(x[c]);
      xi.store(g.xi[c] + l);
      keep(real, far_u[c] - Pack(own[c])).store(g.du[c] + l);
      square += xi * xi;
    }
    sqrt(square).store(g.length + l);
    keep(real, far[3]).store(g.far_volume + l);
    if constexpr (!sums) (Pack(own[3]) + far_u[3]).store(g.q + l);
  }
  if (const double* integrity = families_.integrities()) {
    for (int l = 0; l < n; ++l) {
      const double b = g.integrity[l] = integrity[begin + l];
      g.far_volume[l] *= b;
      // What lies at the far end of a broken bond is nobody's business: it may be anywhere.
      for (int c = 0; c < D && !(b > 0); ++c) g.du[c][l] = 0;
    }
  }
  if (const double* omega = families_.whole_omegas())
    std::copy_n(omega + begin, n, g.omega);
  else
    std::fill_n(g.omega, n, 1.0);
  if constexpr (rate) {
    const Row *const w = w_.data(), own_w = w[p];
    for (int l = 0; l < n; l += pack_width) {
      const RowColumns far_w = RowColumns::load(w, g.far + l);
      for (int c = 0; c < D; ++c) (far_w[c] - Pack(own_w[c])).store(g.dw[c] + l);
      if (dilatation_) (Pack(own_w[3]) + far_w[3]).store(g.dq + l);
    }
  }
  const double* const factor = factors_ ? factors_ + begin : nullptr;
  if constexpr (!sums) {
    if (factor || fields_.modulus.size() > 0) moduli(p, neighbour, n, g, s.modulus);
    for (int l = 0; l < n && factor; ++l) s.modulus[l] *= factor[l];
  }
  if (dilatation_) {
    for (int l = 0; l < n; l += pack_width) (Pack::load(g.omega + l) * Pack::load(g.length + l)).store(g.weight + l);
    for (int l = 0; l < n && factor && fields_.factors->of_dilatation; ++l) g.weight[l] *= factor[l];
  }
  // Dilatations see their own side of bonds that cross an interface.
  const bool crosses = dilatation_ && fields_.crosses(p);
  for (int l = 0; l < n && crosses; ++l) {
    const auto j = static_cast<std::size_t>(neighbour[l]);
    g.own_strain[l] = fields_.own_strain(p, j);
    g.far_strain[l] = fields_.own_strain(j, p);
    if constexpr (!sums) g.q[l] = g.own_strain[l] * own[3] + g.far_strain[l] * u[j][3];
    if constexpr (work == PairWork::tangent) g.dq[l] = g.own_strain[l] * w_[p][3] + g.far_strain[l] * w_[j][3];
  }
  for (int l = n; l < static_cast<int>(padded(static_cast<std::size_t>(n))); ++l) {
    g.omega[l] = g.weight[l] = g.own_strain[l] = 0;
    if (factor || fields_.modulus.size() > 0) s.modulus[l] = 0;
  }
}

template <int D>
template <PairWork work>
bool CloudPairs<D>::run_point(std::size_t p, const PairPass& pass, double& total) {
  constexpr bool sums = work == PairWork::dilatation || work == PairWork::dilatation_rate;
  constexpr bool rate = work == PairWork::dilatation_rate || work == PairWork::tangent;
  const bool half = at_once(pass);
  const bool screened = work == PairWork::force && pass.screen;
  const bool energies = work == PairWork::energy || screened || (work == PairWork::force && pass.energies);
  double highest = 0;  // energy of a bond, over its share where that is asked for
  // Locals: packs that are stored may be any member, as far as the compiler knows.
  const bool dilatation = dilatation_, fails = fails_, weakens = families_.integrities() != nullptr, crosses = dilatation_ && fields_.crosses(p);
  Row* const force = force_.data();
  const std::int64_t end = lists_.first[p + 1];
  alignas(64) PairScratch s;
  alignas(64) Gathered g;
  const double volume = position_[p][3];
  if constexpr (!sums) {
    if (!factors_ && fields_.modulus.size() == 0)
      for (double& c : s.modulus) c = fields_.uniform;
  }
  EightRows own;
  EightSums own_sum, stored;
  PackMask finite = Pack(0.0) == Pack(0.0);
  const Pack onset(nearest_.least_onset);
  Pack excess(-std::numeric_limits<double>::max());
  if (p + 1 < points_) expect_bonds(families_, half ? upper_[p + 1] : end, lists_.first[p + 2]);
  for (std::int64_t begin = half ? upper_[p] : lists_.first[p]; begin < end; begin += batch_points) {
    const int n = static_cast<int>(std::min<std::int64_t>(batch_points, end - begin));
    gather<work>(p, begin, n, g, s);
    const std::int32_t* const neighbour = lists_.neighbour.data() + begin;
    for (int l = 0; l < n; l += pack_width) {
      Pack xi[D], du[D], dw[D];
      for (int c = 0; c < D; ++c) {
        xi[c] = Pack::load(g.xi[c] + l);
        du[c] = Pack::load(g.du[c] + l);
        if constexpr (rate) dw[c] = Pack::load(g.dw[c] + l);
      }
      const Pack length = Pack::load(g.length + l);
      const Stretch<D> bond(xi, length, du);
      finite &= bond.has_length(length);
      if (work == PairWork::force && fails) excess = max(excess, bond.e - onset * length);
      bond.e.store(s.e + l);
      for (int c = 0; c < D; ++c) bond.y[c].store(s.y[c] + l);
      bond.inverse_length.store(s.inverse_length + l);
      if constexpr (rate) bond.along(dw).store(s.de + l);
      if constexpr (sums) (Pack::load(g.weight + l) * Pack::load((rate ? s.de : s.e) + l)).store(g.t + l);
    }
    if constexpr (sums) {
      double* const out = pass.out.data;
      for (int l = 0; l < n; l += pack_width) {
        const Pack t = crosses ? Pack::load(g.own_strain + l) * Pack::load(g.t + l) : Pack::load(g.t + l);
        own_sum.at(l) += t * Pack::load(g.far_volume + l);
      }
      for (int l = 0; l < n && half; ++l) out[neighbour[l]] += (crosses ? g.far_strain[l] : 1.0) * g.t[l] * (weakens ? g.integrity[l] * volume : volume);
      continue;
    }
    law_.bond_law({n, g.length, g.omega, s.e, s.modulus, energies ? s.energy : nullptr,
                   work == PairWork::energy ? nullptr : s.force, work == PairWork::tangent ? s.stiffness : nullptr});
    if (screened) {
      if (pass.screen->over_share) pair_energy_shares(law_, n, g.length, g.omega, s.stiffness);
      for (int l = 0; l < n; ++l) {
        double value = s.energy[l];
        if (pass.by_theta) value += g.weight[l] * s.e[l] * ((crosses ? g.own_strain[l] : 1.0) * pass.by_theta[p] + (crosses ? g.far_strain[l] : 1.0) * pass.by_theta[neighbour[l]]);
        if (pass.screen->over_share) value = s.stiffness[l] > 0 ? value / (s.stiffness[l] * (factors_ ? factors_[begin + l] : 1.0)) : 0.0;
        if (g.far_volume[l] > 0) highest = std::max(highest, value);
      }
    }
    for (int l = 0; l < n && energies; l += pack_width) stored.at(l) += keep(first_lanes(n - l), Pack::load(s.energy + l) * Pack::load(g.far_volume + l));
    if constexpr (work == PairWork::energy) continue;
    for (int l = 0; l < n; l += pack_width) {
      const Pack volumes = Pack(volume) * Pack::load(g.far_volume + l);
      Pack T = Pack::load(s.force + l);
      if (dilatation) T += Pack::load(g.weight + l) * Pack::load(g.q + l);
      RowColumns t;
      if constexpr (work == PairWork::force) {
        T = T * volumes * Pack::load(s.inverse_length + l);
        for (int c = 0; c < D; ++c) t[c] = T * Pack::load(s.y[c] + l);
      } else {
        // d(T n) = dT n + T (dw - n de)/|y|, n = y/|y|
        const Pack de = Pack::load(s.de + l), inverse_length = Pack::load(s.inverse_length + l), turn = T * volumes * inverse_length;
        Pack dT = Pack::load(s.stiffness + l) * de;
        if (dilatation) dT += Pack::load(g.weight + l) * Pack::load(g.dq + l);
        const Pack stretch = (dT * volumes - turn * de) * inverse_length;
        for (int c = 0; c < D; ++c) t[c] = -(stretch * Pack::load(s.y[c] + l) + turn * Pack::load(g.dw[c] + l));
      }
      const std::uint8_t real = first_lanes(n - l);
      for (int c = 0; c < D; ++c) {
        own.at(l)[c] += keep(real, t[c]);
        t[c] = -t[c];
      }
      if (half) t.add_to(force, g.far + l, n - l);
    }
  }
  if (screened && highest > pass.screen->limit + pass.screen->density[p])
    pass.screen->mark(p);
  if (work == PairWork::force && fails) {
    alignas(64) double lanes[pack_width];
    excess.store(lanes);
    nearest_.excess[p] = *std::max_element(lanes, lanes + pack_width);
  }
  if constexpr (sums) pass.out.data[p] += own_sum.total();
  else if constexpr (work == PairWork::energy) pass.out.data[p] = 0.5 * stored.total();
  else force_[p] += own.sum();
  total += (half ? 1.0 : 0.5) * volume * stored.total();
  return all(finite);
}

template <int D>
template <PairWork work>
void CloudPairs<D>::run_block(std::size_t b, const PairPass& pass) {
  for (std::size_t p = blocks_.begin(b); p < blocks_.end(b); ++p) {
    if (pass.only && !marked(pass.only, p)) continue;
    double energy = 0;
    if (!run_point<work>(p, pass, energy)) return report_bad(static_cast<std::int64_t>(p));
    if (pass.energies) pass.energies[p / padding].stored += energy;
  }
}

template <int D>
std::int64_t CloudPairs<D>::run(const PairPass& pass) {
  reset_bad();
  const bool vectors = pass.work == PairWork::force || pass.work == PairWork::tangent;
  if (pass.motion) pass.motion->finish();
  ArrivingRows arrival(pieces_, pass.u, u_, pass.arrival, pass.q.data);
  look(pass, [&](std::size_t b) { return blocks_.moves(pass.u, b); }, &arrival);
  if (fails_) {
    nearest_.u = nullptr;
    nearest_.excess.resize(points_);
  }
  if (pass.w.data) mirror_rows(pass.w, points_, w_, pass.dq.data);
  blocks_.over_points([&](std::size_t p) {
    if (pass.work == PairWork::force && fails_) nearest_.excess[p] = -std::numeric_limits<double>::max();   // at rest, until it is evaluated
    if (vectors) force_[p] = Row{};
    else pass.out.data[p] = 0;
  });
  each_block(pass, colouring_, &arrival, [&](auto work, std::size_t b) { run_block<work.value>(b, pass); });
  if (pass.work == PairWork::force && fails_ && !pass.only && bad() < 0) nearest_.u = &u_;
  if (vectors && bad() < 0) {
    blocks_.over_points([&](std::size_t p) {
      for (int c = 0; c < D; ++c) pass.out.component(c)[p] += force_[p][c];
    });
  }
  return bad();
}

}  // namespace

template <int D>
std::unique_ptr<PairLoop> make_cloud_pairs(const PairLoopParts& parts) {
  return std::make_unique<CloudPairs<D>>(parts);
}
template std::unique_ptr<PairLoop> make_cloud_pairs<1>(const PairLoopParts&);
template std::unique_ptr<PairLoop> make_cloud_pairs<2>(const PairLoopParts&);
template std::unique_ptr<PairLoop> make_cloud_pairs<3>(const PairLoopParts&);

}  // namespace perikit
