#include "spaces/cloud_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>

#include "families/reproducing_kernel.hpp"
#include "operators/samples.hpp"
#include "families/shape_tensor.hpp"

namespace perikit {

template <int D>
CloudModel<D>::CloudModel(const ModelParts& parts)
    : AssemblingModel(parts), body_(*parts.body), laws_(*parts.laws), formulation_(parts.formulation),
      pairs_(formulation_.pair_symmetric && parts.share && !laws_.history()),
      position_(reinterpret_cast<const Row*>(body_.rows().data())),
      families_(body_, *parts.influence, formulation_.weight) {
  const std::size_t n = body_.points();
  if (parts.damage) this->watch_bonds(families_.bond_state());
  const BlockReach reach = cloud_reach(families_.lists, n);
  if (parts.skip && !laws_.history()) quiet_ = QuietBlocks(reach);
  u_.resize(n);
  flux_.resize(D * n);
  if (formulation_.bond) {
    gradient_.resize(D * n);
    force_.resize(n);
    colouring_ = Colouring(reach);
    upper_.resize(n);
    scale_.resize(n);
    for (std::size_t p = 0; p < n; ++p) {
      const auto family = families_.neighbours(p);
      upper_[p] = families_.lists.first[p] + (std::upper_bound(family.begin(), family.end(), static_cast<std::int32_t>(p)) - family.begin());
      scale_[p] = families_.normaliser[p] > 0 ? position_[p][3] / families_.normaliser[p] : 0.0;
    }
    if (formulation_.order > 1) store_stencils();
    if (formulation_.selective()) {
      volume_.resize(n);
      pressure_.resize(n);
      for (std::size_t p = 0; p < n; ++p) volume_[p][volume_share] = share_of_volume(p);
    }
  }
}

template <int D>
void CloudModel<D>::store_stencils() {
  stencil_.assign(D * families_.bonds(), 0.0);
  std::atomic<std::size_t> lower{0};
  parallel_for(blocks(), [&](std::size_t b) {
    FamilyArrays family;
    std::vector<double> g;
    for (std::size_t p = b * block_points; p < std::min(body_.points(), (b + 1) * block_points); ++p) {
      families_.load(p, family);
      lower += reproducing_kernel(family, body_.horizon(), formulation_.order, g) < formulation_.order;
      std::copy(g.begin(), g.end(), stencil_.begin() + D * families_.lists.first[p]);
    }
  });
  fallbacks_ = lower;
}

template <int D>
void CloudModel<D>::moments(std::size_t p, const AlignedVector<Row>& u, Row (&S)[D]) const noexcept {
  const Row x = position_[p], own = u[p];
  for (int e = 0; e < D; ++e) S[e] = Row{};
  for (std::int64_t k = families_.lists.first[p]; k < families_.lists.first[p + 1]; ++k) {
    const auto j = static_cast<std::size_t>(families_.lists.neighbour[static_cast<std::size_t>(k)]);
    const Row xi = position_[j] - x;
    const Row du = (families_.omega[static_cast<std::size_t>(k)] * position_[j][3]) * (u[j] - own);
    for (int e = 0; e < D; ++e) S[e] += xi[e] * du;
  }
}

template <int D>
void CloudModel<D>::flux_row(std::size_t p, const Row* S, Row* Q) const noexcept {
  const double* inverse = &families_.inverse[6 * p];
  Row out[D];
  for (int e = 0; e < D; ++e) {
    out[e] = Row{};
    for (int k = 0; k < D; ++k) out[e] += inverse[symmetric_index(D, k, e)] * S[k];
  }
  for (int e = 0; e < D; ++e) Q[e] = out[e];
}

template <int D>
void CloudModel<D>::gradient_lane(std::size_t p, const AlignedVector<Row>& u, double* H, int lane) const noexcept {
  Row S[D], h[D];
  moments(p, u, S);
  flux_row(p, S, h);
  for (int c = 0; c < D; ++c)
    for (int e = 0; e < D; ++e) H[(c * D + e) * batch_points + lane] = h[e][c];
}

template <int D>
void CloudModel<D>::gradient_rows(std::size_t p, const AlignedVector<Row>& u, AlignedVector<Row>& H) const noexcept {
  if (stencil_.empty()) {
    Row S[D];
    moments(p, u, S);
    flux_row(p, S, &H[D * p]);
    return;
  }
  Row h[D] = {};
  for (std::int64_t k = families_.lists.first[p]; k < families_.lists.first[p + 1]; ++k) {
    const Row du = u[static_cast<std::size_t>(families_.lists.neighbour[static_cast<std::size_t>(k)])] - u[p];
    for (int e = 0; e < D; ++e) h[e] += stencil_[static_cast<std::size_t>(k * D + e)] * du;
  }
  std::copy_n(h, D, &H[D * p]);
}

template <int D>
void CloudModel<D>::points_block(std::size_t b, Pass& pass) {
  BatchScratch& s = scratch_.begin_block(b);
  const std::size_t end = std::min(body_.points(), (b + 1) * block_points);
  double energy = 0;
  for (std::size_t first = b * block_points; first < end; first += batch_points) {
    const int n = static_cast<int>(std::min<std::size_t>(batch_points, end - first));
    const int lanes = static_cast<int>(padded(static_cast<std::size_t>(n)));
    if (pass.only && std::none_of(pass.only + first / padding, pass.only + (first + static_cast<std::size_t>(lanes)) / padding, [](std::uint8_t m) { return m != 0; })) continue;
    for (int l = 0; l < lanes; ++l) {
      const std::size_t p = first + static_cast<std::size_t>(l);
      if (l >= n || !pass.wanted(static_cast<std::int64_t>(p))) {
        for (int c = 0; c < D * D; ++c) s.H[c * batch_points + l] = s.dH[c * batch_points + l] = 0.0;
        s.weight[l] = 0;
        s.owner[l] = static_cast<std::int32_t>(first);
        continue;
      }
      gradient_lane(p, u_, s.H, l);
      if (pass.work.tangent()) gradient_lane(p, w_, s.dH, l);
      s.weight[l] = families_.weight[p];
      s.owner[l] = static_cast<std::int32_t>(p);
    }
    const int bad = pass.work.evaluate(n, s, false, &energy);
    if (bad >= 0) {
      pass.report(static_cast<std::int64_t>(first) + bad);
      return;
    }
    if (pass.work.work() == Work::sample) {
      for (int l = 0; l < n; ++l) s.weight[l] = std::max(s.weight[l], 1e-300);   // a lone point shows its own values
      pass.work.add_samples(n, s, *pass.sums);
      continue;
    }
    if (pass.only) continue;
    for (int l = 0; l < n; ++l) {
      Row S[D];
      for (int e = 0; e < D; ++e) {
        S[e] = Row{};
        for (int c = 0; c < D; ++c) S[e][c] = s.P[(c * D + e) * batch_points + l];
      }
      flux_row(first + static_cast<std::size_t>(l), S, &flux_[D * (first + static_cast<std::size_t>(l))]);
    }
  }
  if (pass.energies) pass.energies[b] = energy;
}

template <int D>
int CloudModel<D>::bonds_of_point(std::size_t p, BatchScratch& s, Pass& pass, double* energy) {
  const bool sample = pass.work.work() == Work::sample, tangent = pass.work.tangent(), mean = formulation_.base == BondBase::mean;
  const bool half = pairs_ && !pass.alone();
  double* const H = formulation_.selective() ? s.Ht : s.H;
  double* const dH = formulation_.selective() ? s.dHt : s.dH;
  double* xi = s.bond[0];
  double* g = s.bond[1];
  double* length = s.bond[2];
  double* omega = s.bond[2] + batch_points;
  double* volume = s.bond[2] + 2 * batch_points;
  const Row x = position_[p];
  const auto gather = [&](const AlignedVector<Row>& u, const AlignedVector<Row>& H, std::int64_t begin, int n, double* du, double* A) {
    for (int l = 0; l < n; ++l) {
      const auto j = static_cast<std::size_t>(families_.lists.neighbour[static_cast<std::size_t>(begin + l)]);
      const Row d = u[j] - u[p];
      for (int c = 0; c < D; ++c) du[c * batch_points + l] = d[c];
      for (int e = 0; e < D; ++e) {
        const Row h = mean ? 0.5 * (H[D * p + static_cast<std::size_t>(e)] + H[D * j + static_cast<std::size_t>(e)]) : H[D * p + static_cast<std::size_t>(e)];
        for (int c = 0; c < D; ++c) A[(c * D + e) * batch_points + l] = h[c];
      }
    }
  };
  for (std::int64_t begin = half ? upper_[p] : families_.lists.first[p]; begin < families_.lists.first[p + 1]; begin += bonds_at_once()) {
    const int n = static_cast<int>(std::min<std::int64_t>(bonds_at_once(), families_.lists.first[p + 1] - begin));
    const int lanes = static_cast<int>(padded(static_cast<std::size_t>(n)));
    for (int l = 0; l < lanes; ++l) {
      const bool real = l < n;
      const auto k = static_cast<std::size_t>(begin + (real ? l : 0));
      const auto j = static_cast<std::size_t>(families_.lists.neighbour[k]);
      const Row bond = position_[j] - x;
      for (int c = 0; c < D; ++c) xi[c * batch_points + l] = bond[c];
      length[l] = std::sqrt(bond[0] * bond[0] + bond[1] * bond[1] + bond[2] * bond[2]);
      omega[l] = real ? families_.omega[k] : 0.0;
      volume[l] = real ? position_[j][3] : 0.0;
      const double factor = !real ? 0.0 : formulation_.weight == BondWeight::kernel ? families_.omega[k] : families_.integrity(k);
      s.weight[l] = scale_[p] * position_[j][3] * factor;
      s.far_weight[l] = scale_[j] * x[3] * factor;
      s.owner[l] = static_cast<std::int32_t>(p);
      s.far[l] = static_cast<std::int32_t>(j);
    }
    gather(u_, gradient_, begin, n, s.du, s.A);
    if (tangent) gather(w_, direction_, begin, n, s.dw, s.dA);
    for (int l = families_.fails() ? 0 : n; l < lanes; ++l) {
      // Padding and broken bonds: H = 0, wherever the far end may be.
      if (l < n && families_.integrity(static_cast<std::size_t>(begin + l)) > 0) continue;
      for (int c = 0; c < D; ++c) s.du[c * batch_points + l] = s.dw[c * batch_points + l] = 0.0;
      for (int c = 0; c < D * D; ++c) s.A[c * batch_points + l] = s.dA[c * batch_points + l] = 0.0;
    }
    if (formulation_.selective()) {
      // One group for the owner, then those of the far ends.
      constexpr int group = static_cast<int>(padding);
      s.owner_volumes = {s.volume, batch_points, s.volume_group, families_.singular == 0 && !families_.fails()};
      for (int l = 0; l < lanes; l += group) {
        s.volume_group[l / group] = 0;
        if (half) s.volume_group[(lanes + l) / group] = l + group;
      }
      for (int c = 0; c < volume_components; ++c) {
        std::fill_n(s.volume + c * batch_points, group, volume_[p][c]);
        for (int l = 0; l < lanes && half; ++l) s.volume[c * batch_points + group + l] = volume_[static_cast<std::size_t>(s.far[l])][c];
      }
    }
    const FamilyView view{D, n, body_.horizon(), {xi, xi + batch_points, xi + 2 * batch_points}, length, volume, omega, &families_.inverse[6 * p], 0};
    formulation_.bond->correction(view, g, batch_points);
    const BondVectors vectors{{xi, xi + batch_points, xi + 2 * batch_points}, {g, g + batch_points, g + 2 * batch_points}, false};
    bond_gradient<D, false>(lanes, vectors, s.A, s.du, H);
    if (tangent) bond_gradient<D, false>(lanes, vectors, s.dA, s.dw, dH);
    const int bad = pass.work.evaluate(n, s, half, energy);
    if (bad >= 0) return bad;
    if (sample) {
      pass.work.add_samples(n, s, *pass.sums);
      continue;
    }
    if (pass.only) continue;
    bond_adjoint<D, false>(lanes, vectors, s.P, s.t, s.P);
    Row own{}, own_stress[D] = {};
    const double share = mean ? 0.5 : 1.0;
    for (int l = 0; l < n; ++l) {
      const auto j = static_cast<std::size_t>(s.far[l]);
      Row t{};
      for (int c = 0; c < D; ++c) t[c] = s.t[c * batch_points + l];
      own += t;
      force_[j] -= t;
      for (int e = 0; e < D; ++e) {
        Row stress{};
        for (int c = 0; c < D; ++c) stress[c] = share * s.P[(c * D + e) * batch_points + l];
        own_stress[e] += stress;
        if (mean) flux_[D * j + static_cast<std::size_t>(e)] += stress;
      }
    }
    if (formulation_.selective()) {
      const auto pressure = [&](int lane) { return Row{s.pressure[lane], tangent ? s.pressure_rate[lane] : 0.0}; };
      for (int l = 0; l < n; ++l) {
        pressure_[p] += pressure(l);
        if (half) pressure_[static_cast<std::size_t>(s.far[l])] += pressure(lanes + l);
      }
    }
    force_[p] += own;
    for (int e = 0; e < D; ++e) flux_[D * p + static_cast<std::size_t>(e)] += own_stress[e];
  }
  return -1;
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
void CloudModel<D>::volumes_block(std::size_t b, bool tangent) noexcept {
  double H[9 * padding], dH[9 * padding], volume[volume_components * padding] = {};
  const std::size_t end = std::min(body_.points(), (b + 1) * block_points);
  for (std::size_t first = b * block_points; first < end; first += padding) {
    const std::size_t n = std::min(padding, end - first);
    OwnerGradients owners = gather_gradients<D>(gradient_, first, n, H);
    if (tangent) owners.dH = gather_gradients<D>(direction_, first, n, dH).H;
    owner_volume(laws_.space(), owners, volume, padding);
    for (std::size_t l = 0; l < n; ++l)
      for (const int c : {volume_jacobian, volume_root, volume_rate}) volume_[first + l][c] = volume[static_cast<std::size_t>(c) * padding + l];
  }
}

template <int D>
void CloudModel<D>::pressures_block(std::size_t b, bool tangent) noexcept {
  double H[9 * padding], dH[9 * padding], pressure[2][padding] = {};
  const std::size_t end = std::min(body_.points(), (b + 1) * block_points);
  for (std::size_t first = b * block_points; first < end; first += padding) {
    const std::size_t n = std::min(padding, end - first);
    OwnerGradients owners = gather_gradients<D>(gradient_, first, n, H);
    if (tangent) owners.dH = gather_gradients<D>(direction_, first, n, dH).H;
    double stress[9 * padding] = {};
    for (std::size_t l = 0; l < n; ++l)
      for (int c = 0; c < 2; ++c) pressure[c][l] = pressure_[first + l][c];
    add_owner_stress(laws_.space(), owners, pressure[0], pressure[1], stress, padding);
    for (std::size_t l = 0; l < n; ++l)
      for (int c = 0; c < D; ++c)
        for (int e = 0; e < D; ++e) flux_[D * (first + l) + static_cast<std::size_t>(e)][c] += stress[static_cast<std::size_t>(c * D + e) * padding + l];
  }
}

template <int D>
void CloudModel<D>::bonds_block(std::size_t b, Pass& pass) {
  BatchScratch& s = scratch_.begin_block(b);
  double energy = 0;
  for (std::size_t p = b * block_points; p < std::min(body_.points(), (b + 1) * block_points); ++p) {
    if (!pass.wanted(static_cast<std::int64_t>(p))) continue;
    if (bonds_of_point(p, s, pass, &energy) >= 0) {
      pass.report(static_cast<std::int64_t>(p));
      return;
    }
  }
  if (pass.energies) pass.energies[b] = energy;
}

template <int D>
void CloudModel<D>::scatter_block(std::size_t b) noexcept {
  for (std::size_t p = b * block_points; p < std::min(body_.points(), (b + 1) * block_points); ++p) {
    const Row* S = &flux_[D * p];
    Row own{};
    for (std::int64_t k = families_.lists.first[p]; k < families_.lists.first[p + 1]; ++k) {
      Row t{};
      for (int e = 0; e < D; ++e) t += stencil_[static_cast<std::size_t>(k * D + e)] * S[e];
      own += t;
      force_[static_cast<std::size_t>(families_.lists.neighbour[static_cast<std::size_t>(k)])] -= t;
    }
    force_[p] += own;
  }
}

template <int D>
void CloudModel<D>::divergence(std::size_t p, FieldView out) const noexcept {
  const Row x = position_[p];
  Row f = force_.empty() ? Row{} : force_[p];
  const Row* own = &flux_[D * p];
  for (std::int64_t k = families_.lists.first[p]; k < families_.lists.first[p + 1]; ++k) {
    const auto j = static_cast<std::size_t>(families_.lists.neighbour[static_cast<std::size_t>(k)]);
    const Row far = position_[j], xi = far - x;
    const double w = families_.omega[static_cast<std::size_t>(k)], to_own = w * far[3], to_far = w * x[3];
    for (int e = 0; e < D; ++e) f += xi[e] * (to_own * own[e] + to_far * flux_[D * j + static_cast<std::size_t>(e)]);
  }
  for (int c = 0; c < D; ++c) out.component(c)[p] = f[c];
}

template <int D>
EvaluationStatus CloudModel<D>::run(Pass& pass) {
  scratch_.prepare(laws_);
  mirror_rows(pass.u, body_.points(), u_);
  const bool alone = pass.alone(), tangent = pass.work.tangent(), points = formulation_.point != nullptr;
  const int last = points ? 2 : 3;
  if (tangent) mirror_rows(pass.w, body_.points(), w_);
  if (alone || tangent) quiet_.wake();
  else quiet_.look(last, [&](std::size_t b) { return cloud_moves(pass.u, b, body_.points()); });
  const auto over_points = [&](std::size_t b, auto&& body) {
    for (std::size_t p = b * block_points; p < std::min(body_.points(), (b + 1) * block_points); ++p) body(p);
  };
  const auto awake = [&](int number, auto&& block) { return [&, number](std::size_t b) { if (quiet_.awake(b, number)) block(b); }; };
  const auto first_pass = [&](auto&& block) {
    parallel_for(blocks(), [&](std::size_t b) { if (quiet_.begins(b)) block(b); });
  };
  if (points) {
    first_pass([&](std::size_t b) { points_block(b, pass); });
  } else {
    if (tangent) direction_.resize(D * body_.points());
    first_pass([&](std::size_t b) {
      over_points(b, [&](std::size_t p) {
        if (!pass.gradient_wanted(static_cast<std::int64_t>(p))) return;
        gradient_rows(p, u_, gradient_);
        if (tangent) gradient_rows(p, w_, direction_);
        force_[p] = Row{};
        for (std::size_t e = 0; e < D; ++e) flux_[D * p + e] = Row{};
        if (formulation_.selective()) pressure_[p] = Row{};
      });
      if (formulation_.selective()) volumes_block(b, tangent);
    });
    if (alone) {
      parallel_for(blocks(), [&](std::size_t b) { bonds_block(b, pass); });
    } else {
      colouring_.for_each(awake(2, [&](std::size_t b) { bonds_block(b, pass); }));
      if (formulation_.selective()) parallel_for(blocks(), awake(2, [&](std::size_t b) { pressures_block(b, tangent); }));
      if (stencil_.empty()) {
        parallel_for(blocks(), awake(2, [&](std::size_t b) { over_points(b, [&](std::size_t p) { flux_row(p, &flux_[D * p], &flux_[D * p]); }); }));
      } else {
        colouring_.for_each(awake(2, [&](std::size_t b) { scatter_block(b); }));
      }
    }
  }
  if (pass.bad >= 0 || alone) return status_at(body_, pass.bad);
  parallel_for(blocks(), [&](std::size_t b) {
    const bool gather = stencil_.empty() && quiet_.awake(b, last);
    over_points(b, [&](std::size_t p) {
      if (gather) return divergence(p, pass.out);
      for (int c = 0; c < D; ++c) pass.out.component(c)[p] = force_.empty() ? 0.0 : force_[p][c];
    });
  });
  return {};
}

template <int D>
EvaluationStatus CloudModel<D>::forces(ConstFieldView u, FieldView force, double* energy) {
  return run_forces(laws_, formulation_.selective(), blocks(), u, force, energy, [&](Pass& pass) { return run(pass); });
}

template <int D>
EvaluationStatus CloudModel<D>::tangent(ConstFieldView u, ConstFieldView w, FieldView Kw) {
  const BatchWork work(laws_, Work::tangent, false, formulation_.selective());
  Pass pass{work, u, w, Kw, nullptr, nullptr, -1, {}};
  return run(pass);
}

template <int D>
EvaluationStatus CloudModel<D>::sample(ConstFieldView u, PointSamples& samples) {
  return run_samples(body_, laws_, formulation_.selective(), u, samples, [&](Pass& pass) { return run(pass); });
}

template <int D>
std::vector<BondChange> CloudModel<D>::bonds_changed(std::span<const std::int32_t> points) {
  std::vector<BondChange> fragments = families_.changed(points);
  if (formulation_.selective())
    for (const std::int32_t p : points) volume_[static_cast<std::size_t>(p)][volume_share] = share_of_volume(static_cast<std::size_t>(p));
  return fragments;
}

template <int D>
double CloudModel<D>::energy_of(ConstFieldView u, const GroupMarks& marks) {
  return run_energy(body_, laws_, formulation_.selective(), blocks(), u, marks, families_.bond_state(),
                    [&](Pass& pass) { return run(pass); });
}

template <int D>
ModelReport CloudModel<D>::report() const {
  ModelReport report;
  report.bonds = families_.bonds();
  report.broken_bonds = families_.broken;
  report.singular_families = families_.singular;
  report.fallbacks = fallbacks_;
  const bool bonds = formulation_.bond != nullptr;
  report.evaluation_points = bonds ? (pairs_ ? report.bonds / 2 : report.bonds) : body_.points();
  report.bytes = families_.bytes() + stencil_.size() * sizeof(double) + upper_.size() * sizeof(std::int64_t) +
                 scale_.size() * sizeof(double) +
                 (u_.size() + w_.size() + gradient_.size() + direction_.size() + flux_.size() + force_.size() + volume_.size() +
                  pressure_.size()) *
                     sizeof(Row) +
                 scratch_.bytes() + this->fracture_bytes();
  report.skips.push_back({"bond vectors", "recomputed from positions", fmt::format("{:.3g} MB", static_cast<double>(report.bonds) * 8 * (D + 1) / 1e6)});
  if (pairs_) {
    report.skips.push_back({"second evaluation of each bond", "the gradient is the same for ij and ji", fmt::format("{} of {} evaluations", report.bonds / 2, report.bonds)});
  }
  return report;
}

template class CloudModel<1>;
template class CloudModel<2>;
template class CloudModel<3>;

}  // namespace perikit
