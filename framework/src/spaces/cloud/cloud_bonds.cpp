#include "spaces/cloud/cloud_bonds.hpp"

#include <algorithm>

namespace perikit {

namespace {

/// As read_bonds leaves them.
BondVectors vectors_in(const BatchScratch& s) noexcept {
  const auto rows = [](const double* first, const double*(&to)[3]) {
    for (int c = 0; c < 3; ++c) to[c] = first + c * batch_points;
  };
  BondVectors vectors{.per_slot = false};
  rows(s.bond[0], vectors.xi);
  rows(s.bond[1], vectors.g);
  return vectors;
}

}  // namespace

template <int D>
CloudBonds<D>::CloudBonds(const SpaceParts& parts)
    : families_(*parts.families.cloud()),
      formulation_(parts.formulation),
      laws_(parts.laws),
      selective_(formulation_.selective()),
      far_share_(formulation_.far_share),
      without_(families_),
      pairs_(formulation_.pair_symmetric && parts.share),
      two_states_(pairs_ && (selective_ || !laws_.single())),
      points_(families_.body().points()),
      blocks_(families_.body()),
      position_(reinterpret_cast<const Row*>(families_.body().rows().data())),
      gradient_of_(families_, formulation_.order),
      upper_(points_),
      scale_(families_.body().stride()),
      pieces_(families_.body()),
      u_(pieces_.size()),
      gradient_(D * points_),
      flux_(D * points_),
      force_(points_) {
  BlockReach reach = cloud_reach(families_.body(), families_.lists());
  sequence_ = BlockSequence(reach);
  quiet_ = parts.quiet_blocks(reach);
  reach.elsewhere.clear();  // everything has arrived before the first block scatters
  colouring_ = cloud_colouring(families_.body(), families_.lists(), blocks_, reach);
  for (std::size_t p = 0; p < points_; ++p) {
    const double normaliser = families_.normaliser(p, formulation_.weight);
    upper_[p] = families_.index(static_cast<std::int32_t>(p), static_cast<std::int32_t>(p));
    scale_[p] = normaliser > 0 ? position_[p][3] / normaliser : 0.0;
  }
  if (parts.numbered()) number_bonds();
  if (!selective_) return;
  volume_.resize(points_);
  pressure_.resize(points_);
  for (std::size_t p = 0; p < points_; ++p) volume_[p][volume_share] = share_of_volume(p);
}

template <int D>
void CloudBonds<D>::bonds_changed(std::span<const std::int32_t> points) {
  last_ = Last::other;
  without_.renew(points);
  for (const std::int32_t point : points) {
    const auto p = static_cast<std::size_t>(point);
    gradient_of_.renew(p);
    if (selective_) volume_[p][volume_share] = share_of_volume(p);
  }
}

template <int D>
void CloudBonds<D>::set_factors(std::span<const double> factors) {
  factor_ = factors.empty() ? nullptr : factors.data();
  if (!pairs_ || !factor_) return;
  const FamilyLists& lists = families_.lists();
  if (far_first_.empty()) {
    std::int64_t evaluated = 0;
    for (std::size_t p = 0; p < points_; ++p) {
      far_first_.push_back(evaluated);
      evaluated += lists.first[p + 1] - upper_[p];
    }
    far_factor_.resize(static_cast<std::size_t>(evaluated));
  }
  parallel_for(blocks_.count(), [&](std::size_t b) {
    over_points(b, [&](std::size_t p) {
      double* to = far_factor_.data() + far_first_[p];
      for (auto k = static_cast<std::size_t>(upper_[p]); k < static_cast<std::size_t>(lists.first[p + 1]); ++k)
        *to++ = factors[static_cast<std::size_t>(families_.index(lists.neighbour[k], static_cast<std::int32_t>(p)))];
    });
  });
}

template <int D>
void CloudBonds<D>::shift_gradients(ConstFieldView lambda) {
  gradient_of_.shift(lambda);
  stress_.assign(D * points_, Row{});
}

/// Bonds begin ... begin + n - 1 as arrays: xi, length, omega, volume, weights of both ends, and the ends. Lanes beyond them are the first
/// bond without weight.
template <int D>
void CloudBonds<D>::read_bonds(std::size_t p, std::int64_t begin, int n, int lanes, BatchScratch& s) const noexcept {
  double *xi = s.bond[0], *length = s.bond[2], *omega = s.bond[2] + batch_points, *volume = s.bond[2] + 2 * batch_points;
  const std::int32_t* const neighbour = families_.lists().neighbour.data() + begin;
  std::fill_n(s.owner, lanes, static_cast<std::int32_t>(p));
  std::copy_n(neighbour, n, s.far);
  std::fill(s.far + n, s.far + lanes, neighbour[0]);
  const double* const influence = families_.omegas() + begin;
  const double* const left = families_.integrities();
  // Where bonds are evaluated for both ends.
  const double* const far_factor = factor_ && pairs_ && begin >= upper_[p] ? far_factor_.data() + far_first_[p] + (begin - upper_[p]) : nullptr;
  const double* const share = formulation_.weight == BondWeight::kernel ? influence : left ? left + begin : nullptr;
  const Row *const position = position_, *const scale = u_.data(), x = position[p];
  const Pack own_volume(x[3]), own_scale(scale[p][3]);
  for (int l = 0; l < lanes; l += pack_width) {
    // By bond: those of the lists, zero beyond.
    const auto of_bonds = [&](const double* values) {
      return l + pack_width <= n ? Pack::load(values + l) : Pack::load_first(values + l, n - l);
    };
    const std::uint8_t real = first_lanes(n - l);
    const RowColumns far = RowColumns::load(position, s.far + l), far_u = RowColumns::load(scale, s.far + l);
    Pack square(0.0);
    for (int c = 0; c < D; ++c) {
      const Pack bond = far[c] - Pack(x[c]);
      bond.store(xi + c * batch_points + l);
      square += bond * bond;
    }
    sqrt(square).store(length + l);
    of_bonds(influence).store(omega + l);
    keep(real, far[3]).store(volume + l);
    const Pack factor = share ? of_bonds(share) : keep(real, Pack(1.0));
    Pack weight = own_scale * far[3] * factor, far_weight = far_u[3] * own_volume * factor;
    if (factor_) {
      weight *= of_bonds(factor_ + begin);
      if (far_factor) far_weight *= of_bonds(far_factor);
    }
    weight.store(s.weight + l);
    far_weight.store(s.far_weight + l);
  }
}

/// H of n bonds, from u and Hbar of their ends. What lies at the far end of a broken bond is nobody's business: H = 0 there, and in the padding.
template <int D>
void CloudBonds<D>::bond_gradients(std::size_t p, std::int64_t begin, int n, int lanes, const BatchScratch& s, const AlignedVector<Row>& u,
                                   const AlignedVector<Row>& H, double* out) const noexcept {
  // Locals: what is written could be any double that a member is.
  const Row *const at = u.data(), *const gradient = H.data(), *const own_gradient = gradient + D * p, here = at[p];
  const double* const left = families_.integrities();
  const double far_share = far_share_;
  Pack own[D][D];
  for (int c = 0; c < D; ++c)
    for (int e = 0; e < D; ++e) own[c][e] = Pack((1 - far_share) * own_gradient[e][c]);
  for (int l = 0; l < lanes; l += pack_width) {
    std::uint8_t whole = first_lanes(n - l);
    for (int i = 0; i < pack_width && left; ++i)
      if (l + i < n && !(left[begin + l + i] > 0)) whole = static_cast<std::uint8_t>(whole & ~(1u << i));
    const bool all_whole = whole == first_lanes(pack_width);
    RowColumns far = RowColumns::load(at, s.far + l);
    Pack A[D][D], xi[D], g[D];
    PERIKIT_UNROLL for (int c = 0; c < D; ++c) PERIKIT_UNROLL for (int e = 0; e < D; ++e) A[c][e] = own[c][e];
    if (far_share != 0) {
      PERIKIT_UNROLL for (int e = 0; e < D; ++e) {
        const RowColumns h = RowColumns::load(gradient + e, s.far + l, D);
        PERIKIT_UNROLL for (int c = 0; c < D; ++c) A[c][e] += Pack(far_share) * h[c];
      }
    }
    PERIKIT_UNROLL for (int e = 0; e < D; ++e) {
      xi[e] = Pack::load(s.bond[0] + e * batch_points + l);
      g[e] = Pack::load(s.bond[1] + e * batch_points + l);
    }
    PERIKIT_UNROLL for (int c = 0; c < D; ++c) {
      Pack h[D];
      bond_shape_row<D>(A[c], far[c] - Pack(here[c]), xi, g, h);
      PERIKIT_UNROLL for (int e = 0; e < D; ++e) (all_whole ? h[e] : keep(whole, h[e])).store(out + (c * D + e) * batch_points + l);
    }
  }
}

template <int D>
template <class Visit>
void CloudBonds<D>::over_one_sided(std::size_t p, std::int64_t begin, int n, const BatchScratch& s, Visit&& visit) const {
  for (int l = 0; l < n; ++l) {
    const auto far = static_cast<std::size_t>(s.far[l]);
    if ((without_[p] || without_[far]) && families_.b(static_cast<std::size_t>(begin + l)) > 0)
      visit(l, far, end_shares(far_share_, !without_[p], !without_[far]));
  }
}

/// Replaces the H of bonds beside points without a gradient. Where neither end has one, a law with history may still hold a stress: it has no weight.
template <int D>
void CloudBonds<D>::one_sided_gradients(std::size_t p, std::int64_t begin, int n, BatchScratch& s, const AlignedVector<Row>& u,
                                        const AlignedVector<Row>& H, double* out) const noexcept {
  const BondVectors vectors = vectors_in(s);
  over_one_sided(p, begin, n, s, [&](int lane, std::size_t far, const EndShares& shares) {
    if (shares.none()) s.weight[lane] = s.far_weight[lane] = 0;
    double xi[D], g[D], A[D], row[D];
    vectors.of(lane, lane, xi, g);
    for (int c = 0; c < D; ++c) {
      for (std::size_t e = 0; e < D; ++e) A[e] = shares.near * H[D * p + e][c] + shares.far * H[D * far + e][c];
      bond_shape_row<D>(A, u[far][c] - u[p][c], xi, g, row);
      for (int e = 0; e < D; ++e) out[(c * D + e) * batch_points + lane] = shares.none() ? 0.0 : row[e];
    }
  });
}

/// Gives the ends of these bonds what their shares differ from those that `scatter` has taken for granted.
template <int D>
void CloudBonds<D>::one_sided_stress(std::size_t p, std::int64_t begin, int n, const BatchScratch& s) noexcept {
  const BondVectors vectors = vectors_in(s);
  over_one_sided(p, begin, n, s, [&](int lane, std::size_t far, const EndShares& shares) {
    if (shares.none()) return;
    double xi[D], g[D], row[D];
    vectors.of(lane, lane, xi, g);
    for (int c = 0; c < D; ++c) {
      for (int e = 0; e < D; ++e) row[e] = (s.stress_weight ? s.stress_weight[lane] : 1.0) * s.P[(c * D + e) * batch_points + lane];
      bond_shape_row_adjoint<D>(row, xi, g);
      for (std::size_t e = 0; e < D; ++e) {
        flux_[D * p + e][c] += (shares.near - (1 - far_share_)) * row[e];
        flux_[D * far + e][c] += (shares.far - far_share_) * row[e];
      }
    }
  });
}

/// One group for the owner, then those of the far ends.
template <int D>
void CloudBonds<D>::volumes_of_bonds(std::size_t p, int lanes, bool both_ends, BatchScratch& s) const noexcept {
  constexpr int group = static_cast<int>(padding);
  s.owner_volumes = {s.volume, batch_points, s.volume_group, families_.singular() == 0 && !families_.fails()};
  for (int l = 0; l < lanes; l += group) {
    s.volume_group[l / group] = 0;
    if (both_ends) s.volume_group[(lanes + l) / group] = l + group;
  }
  for (int c = 0; c < volume_components; ++c) std::fill_n(s.volume + c * batch_points, group, volume_[p][c]);
  for (int l = 0; l < lanes && both_ends; l += pack_width) {
    const RowColumns far = RowColumns::load(volume_.data(), s.far + l);
    for (int c = 0; c < volume_components; ++c) far[c].store(s.volume + c * batch_points + group + l);
  }
}

template <int D>
int CloudBonds<D>::bonds_of_point(std::size_t p, BatchScratch& s, Pass& pass, GroupEnergy* energy) {
  const bool tangent = pass.work.tangent(), both_ends = pairs_ && !pass.gathers_only();
  double* const H = selective_ ? s.Ht : s.H;
  double* const dH = selective_ ? s.dHt : s.dH;
  double *xi = s.bond[0], *g = s.bond[1];
  const std::int64_t end = families_.lists().first[p + 1];
  if (p + 1 < points_) expect_bonds(families_, both_ends ? upper_[p + 1] : end, families_.lists().first[p + 2]);
  for (std::int64_t begin = both_ends ? upper_[p] : families_.lists().first[p]; begin < end; begin += bonds_at_once()) {
    const int n = static_cast<int>(std::min<std::int64_t>(bonds_at_once(), end - begin));
    const int lanes = static_cast<int>(padded(static_cast<std::size_t>(n)));
    read_bonds(p, begin, n, lanes, s);
    if (selective_) volumes_of_bonds(p, lanes, both_ends, s);
    const FamilyView view{D, n, families_.body().horizon(), {xi, xi + batch_points, xi + 2 * batch_points}, s.bond[2], s.bond[2] + 2 * batch_points,
                          s.bond[2] + batch_points, families_.inverse_shape(p), 0};
    formulation_.bond->correction(view, g, batch_points);
    for (int e = 0; e < D; ++e) std::fill(g + e * batch_points + n, g + e * batch_points + lanes, 0.0);
    bond_gradients(p, begin, n, lanes, s, u_, gradient_, H);
    if (tangent) bond_gradients(p, begin, n, lanes, s, w_, direction_, dH);
    if (without_.any()) {
      one_sided_gradients(p, begin, n, s, u_, gradient_, H);
      if (tangent) one_sided_gradients(p, begin, n, s, w_, direction_, dH);
    }
    if (pass.work.numbered()) number(p, begin, n, lanes, s);
    const int bad = pass.work.evaluate(n, s, both_ends, energy);
    if (bad >= 0) return bad;
    if (pass.work.screens_bonds())
      pass.work.screen_bonds(n, !both_ends ? -1 : selective_ ? lanes : 0, s, factor_ ? factor_ + begin : nullptr,
                             factor_ && both_ends ? far_factor_.data() + far_first_[p] + (begin - upper_[p]) : nullptr);
    if (pass.work.work() == Work::sample) pass.add_samples(n, s);
    if (pass.work.balance() && pass.gathers_only()) std::copy_n(s.psi, n, pass.work.balance()->factors + begin);
    if (pass.gathers_only()) continue;
    scatter(p, n, s, both_ends, tangent);
    if (without_.any()) one_sided_stress(p, begin, n, s);
  }
  return -1;
}

/// Forces, stresses on the point gradients, and pressures of n bonds.
template <int D>
void CloudBonds<D>::scatter(std::size_t p, int n, const BatchScratch& s, bool both_ends, bool tangent) noexcept {
  Row *const force = force_.data(), *const flux = flux_.data();
  const double far_share = far_share_;
  EightRows own, own_stress[D];
  for (int l = 0; l < n; l += pack_width) {
    Pack xi[D], g[D];
    RowColumns t, stress[D];  // t: on the far ends
    const Pack weight = s.stress_weight ? Pack::load(s.stress_weight + l) : Pack(1.0);
    PERIKIT_UNROLL for (int e = 0; e < D; ++e) {
      xi[e] = Pack::load(s.bond[0] + e * batch_points + l);
      g[e] = Pack::load(s.bond[1] + e * batch_points + l);
    }
    PERIKIT_UNROLL for (int c = 0; c < D; ++c) {
      Pack P[D];
      PERIKIT_UNROLL for (int e = 0; e < D; ++e) P[e] = weight * Pack::load(s.P + (c * D + e) * batch_points + l);
      const Pack owners = bond_shape_row_adjoint<D>(P, xi, g);
      own.at(l)[c] += owners;
      t[c] = -owners;
      PERIKIT_UNROLL for (int e = 0; e < D; ++e) {
        own_stress[e].at(l)[c] += P[e];
        stress[e][c] = Pack(far_share) * P[e];
      }
    }
    t.add_to(force, s.far + l, n - l);
    if (far_share > 0) {
      PERIKIT_UNROLL for (int e = 0; e < D; ++e) stress[e].add_to(flux + e, s.far + l, n - l, D);
    }
  }
  const auto pressure = [&](int lane) { return Row{s.pressure[lane], tangent ? s.pressure_rate[lane] : 0.0}; };
  const int lanes = static_cast<int>(padded(static_cast<std::size_t>(n)));
  for (int l = 0; l < n && selective_; ++l) {
    pressure_[p] += pressure(l);
    if (both_ends) pressure_[static_cast<std::size_t>(s.far[l])] += pressure(lanes + l);
  }
  force[p] += own.sum();
  for (int e = 0; e < D; ++e) flux[D * p + static_cast<std::size_t>(e)] += (1 - far_share) * own_stress[e].sum();
}

/// Eight points at a time: rows of gradients to lanes.
template <int D>
static OwnerGradients gather_gradients(const AlignedVector<Row>& rows, std::size_t first, std::size_t n, double* H) noexcept {
  for (int c = 0; c < D; ++c)
    for (int e = 0; e < D; ++e)
      for (std::size_t l = 0; l < padding; ++l) H[static_cast<std::size_t>(c * D + e) * padding + l] = l < n ? rows[D * (first + l) + static_cast<std::size_t>(e)][c] : 0.0;
  return {static_cast<int>(padding), padding, H, nullptr};
}

template <int D>
void CloudBonds<D>::volumes(std::size_t b, const Pass& pass) noexcept {
  const bool tangent = pass.work.tangent();
  double H[9 * padding], dH[9 * padding], volume[volume_components * padding] = {};
  const std::size_t end = blocks_.end(b);
  for (std::size_t first = blocks_.begin(b); first < end; first += padding) {
    if (!pass.gradients_wanted(first)) continue;
    const std::size_t n = std::min(padding, end - first);
    OwnerGradients owners = gather_gradients<D>(gradient_, first, n, H);
    if (tangent) owners.dH = gather_gradients<D>(direction_, first, n, dH).H;
    owner_volume(laws_.space(), owners, volume, padding);
    for (std::size_t l = 0; l < n; ++l)
      for (const int c : {volume_jacobian, volume_root, volume_rate}) volume_[first + l][c] = volume[static_cast<std::size_t>(c) * padding + l];
  }
}

template <int D>
void CloudBonds<D>::pressures(std::size_t b, const Pass& pass) noexcept {
  const bool tangent = pass.work.tangent();
  double H[9 * padding], dH[9 * padding], pressure[2][padding] = {};
  const std::size_t end = blocks_.end(b);
  for (std::size_t first = blocks_.begin(b); first < end; first += padding) {
    if (!pass.gradients_wanted(first)) continue;
    const std::size_t n = std::min(padding, end - first);
    OwnerGradients owners = gather_gradients<D>(gradient_, first, n, H);
    if (tangent) owners.dH = gather_gradients<D>(direction_, first, n, dH).H;
    double stress[9 * padding] = {};
    for (std::size_t l = 0; l < n; ++l)
      for (int c = 0; c < 2; ++c) pressure[c][l] = pass.gradient_wanted(static_cast<std::int64_t>(first + l)) ? pressure_[first + l][c] : 0.0;
    add_owner_stress(laws_.space(), owners, pressure[0], pressure[1], stress, padding);
    for (std::size_t l = 0; l < n; ++l)
      for (int c = 0; c < D; ++c)
        for (int e = 0; e < D; ++e) flux_[D * (first + l) + static_cast<std::size_t>(e)][c] += stress[static_cast<std::size_t>(c * D + e) * padding + l];
  }
}

template <int D>
void CloudBonds<D>::gradients(std::size_t b, Pass& pass) {
  over_points(b, [&](std::size_t p) {
    if (!pass.gathers_only()) {
      // Of other points, too: what was left of them depends on what was evaluated before.
      std::fill_n(&flux_[D * p], D, Row{});
      if (gradient_of_.shifted()) std::fill_n(&stress_[D * p], D, Row{});
    }
    if (!pass.gradient_wanted(static_cast<std::int64_t>(p))) return;
    gradient_of_.at(p, u_, &gradient_[D * p]);
    if (pass.work.tangent()) gradient_of_.at(p, w_, &direction_[D * p]);
    force_[p] = Row{};
    if (selective_) pressure_[p] = Row{};
  });
  if (selective_) volumes(b, pass);
}

template <int D>
void CloudBonds<D>::bonds(std::size_t b, Pass& pass) {
  BatchScratch& s = scratch_.mine();
  for (std::size_t p = blocks_.begin(b); p < blocks_.end(b); ++p) {
    GroupEnergy unwanted, &energy = pass.energies ? pass.energies[p / padding] : unwanted;
    if (pass.wanted(static_cast<std::int64_t>(p)) && bonds_of_point(p, s, pass, &energy) >= 0) return pass.report(static_cast<std::int64_t>(p));
  }
}

template <int D>
void CloudBonds<D>::run(Pass& pass) {
  scratch_.prepare(laws_, pass.work.laminates());
  constexpr int last = 3;
  last_ = pass.work.work() != Work::force || pass.work.balance() ? Last::other : pass.only ? Last::some_forces : Last::all_forces;
  const bool tangent = pass.work.tangent();
  ArrivingRows arrival(pieces_, pass.u, u_, pass.arrival, scale_.data());
  if (tangent) {
    mirror_rows(pass.w, points_, w_);
    direction_.resize(D * points_);
  }
  if (pass.everywhere())
    quiet_.wake();
  else
    quiet_.look(last, [&](std::size_t b) { return blocks_.moves(pass.u, b); }, &arrival);
  // Each pass reads what the one before it left at one family's reach.
  const auto awake = [&](auto&& block) {
    return [&](std::size_t b) {
      if (quiet_.awake(b, 2)) block(b);
    };
  };
  sequence_.for_each(
      [&](std::size_t b) {
        if (quiet_.begins(b)) gradients(b, pass);
      },
      &arrival);
  if (pass.gathers_only()) return parallel_for(blocks_.count(), [&](std::size_t b) { bonds(b, pass); });
  colouring_.for_each(awake([&](std::size_t b) { bonds(b, pass); }));
  if (selective_) parallel_for(blocks_.count(), awake([&](std::size_t b) { pressures(b, pass); }));
  auto stress_on_points = [&](std::size_t b) {
    if (!quiet_.awake(b, 2)) return;
    over_points(b, [&](std::size_t p) {
      if (!pass.gradient_wanted(static_cast<std::int64_t>(p))) return;
      if (gradient_of_.stored()) return gradient_of_.scatter(p, &flux_[D * p], force_);
      if (gradient_of_.shifted()) gradient_of_.keep_stress(p, &flux_[D * p], &stress_[D * p]);
      gradient_of_.times_transposed(p, &flux_[D * p], &flux_[D * p]);
    });
  };
  if (gradient_of_.stored()) colouring_.for_each(stress_on_points);
  else parallel_for(blocks_.count(), stress_on_points);
  if (pass.bad >= 0) return;
  parallel_for(blocks_.count(), [&](std::size_t b) {
    const bool gather = !gradient_of_.stored() && quiet_.awake(b, last);
    over_points(b, [&](std::size_t p) {
      if (!pass.gradient_wanted(static_cast<std::int64_t>(p))) return;  // also what others than `only` feel of these
      const Row f = gather ? gradient_of_.divergence(p, flux_, stress_, force_[p]) : force_[p];
      for (int c = 0; c < D; ++c) pass.out.component(c)[p] += f[c];
    });
  });
}

/// Bonds of one point follow each other, from a multiple of `padding` on.
template <int D>
void CloudBonds<D>::number_bonds() {
  number_.resize(points_);
  for (std::size_t p = 0; p < points_; ++p) {
    number_[p] = static_cast<std::int64_t>(one_end_);
    one_end_ += padded(static_cast<std::size_t>(families_.lists().first[p + 1] - first_bond(p)));
  }
}

template <int D>
void CloudBonds<D>::number(std::size_t p, std::int64_t begin, int n, int lanes, BatchScratch& s) const noexcept {
  s.far_number = far_number();
  s.first_number = begin >= first_bond(p) ? state_number(p, begin, p) : -1;
  for (int l = 0; l < lanes && s.first_number < 0; ++l) s.number[l] = l < n ? state_number(p, begin + l, static_cast<std::size_t>(s.far[l])) : -1;
}

template <int D>
void CloudBonds<D>::report(ModelReport& report) const {
  report.fallbacks += gradient_of_.fallbacks();
  report.evaluation_points += pairs_ ? families_.bonds() / 2 : families_.bonds();
  report.bytes += gradient_of_.bytes() + (upper_.size() + number_.size() + far_first_.size()) * sizeof(std::int64_t) +
                  (scale_.size() + far_factor_.size()) * sizeof(double) + scratch_.bytes() +
                  (u_.size() + w_.size() + gradient_.size() + direction_.size() + flux_.size() + stress_.size() + force_.size() +
                   volume_.size() + pressure_.size()) *
                      sizeof(Row);
  if (pairs_) report.skips.push_back(second_evaluation(families_.bonds()));
}

template class CloudBonds<1>;
template class CloudBonds<2>;
template class CloudBonds<3>;

}  // namespace perikit
