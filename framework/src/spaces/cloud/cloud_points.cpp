#include "spaces/cloud/cloud_points.hpp"

#include <algorithm>

namespace perikit {

template <int D>
CloudPoints<D>::CloudPoints(const SpaceParts& parts)
    : families_(*parts.families.cloud()),
      laws_(parts.laws),
      points_(families_.body().points()),
      blocks_(families_.body()),
      position_(reinterpret_cast<const Row*>(families_.body().rows().data())),
      gradient_(families_),
      pieces_(families_.body()),
      u_(pieces_.size()),
      flux_(D * points_) {
  const BlockReach reach = cloud_reach(families_.body(), families_.lists());
  sequence_ = BlockSequence(reach);
  quiet_ = parts.quiet_blocks(reach);
}

template <int D>
void CloudPoints<D>::block(std::size_t b, Pass& pass) {
  BatchScratch& s = scratch_.mine();
  const std::size_t end = blocks_.end(b);
  const auto gradient_lane = [&](std::size_t p, const AlignedVector<Row>& u, double* H) {
    Row h[D];
    gradient_.at(p, u, h);
    for (int c = 0; c < D; ++c)
      for (int e = 0; e < D; ++e) H[(c * D + e) * batch_points] = h[e][c];
  };
  for (std::size_t first = blocks_.begin(b); first < end; first += batch_points) {
    const int n = static_cast<int>(std::min<std::size_t>(batch_points, end - first));
    const int lanes = static_cast<int>(padded(static_cast<std::size_t>(n)));
    if (pass.only && std::none_of(pass.only + first / padding, pass.only + (first + static_cast<std::size_t>(lanes)) / padding,
                                  [](std::uint8_t m) { return m != 0; })) {
      // As that of single points that are not wanted, whose weight is 0: what was left depends on what was evaluated before.
      std::fill_n(&flux_[D * first], D * static_cast<std::size_t>(n), Row{});
      if (gradient_.shifted()) std::fill_n(&stress_[D * first], D * static_cast<std::size_t>(n), Row{});
      continue;
    }
    std::fill_n(s.far, lanes, -1);
    for (int l = 0; l < lanes; ++l) {
      const std::size_t p = first + static_cast<std::size_t>(l);
      if (l >= n || !pass.wanted(static_cast<std::int64_t>(p))) {
        for (int c = 0; c < D * D; ++c) s.H[c * batch_points + l] = s.dH[c * batch_points + l] = 0.0;
        s.weight[l] = 0;
        s.owner[l] = static_cast<std::int32_t>(first);
        continue;
      }
      gradient_lane(p, u_, s.H + l);
      if (pass.work.tangent()) gradient_lane(p, w_, s.dH + l);
      s.weight[l] = position_[p][3] * (1 - families_.damage(p));
      // A point without bonds shows its own values, and its history is part of the state that a run goes on from.
      if (pass.work.work() == Work::sample) s.weight[l] = std::max(s.weight[l], 1e-300);
      s.owner[l] = static_cast<std::int32_t>(p);
    }
    s.first_number = static_cast<std::int64_t>(first);
    GroupEnergy energy;
    const int bad = pass.work.evaluate(n, s, false, &energy);
    if (bad >= 0) return pass.report(static_cast<std::int64_t>(first) + bad);
    if (pass.energies) pass.energies[first / padding] = energy;
    for (int l = 0; l < lanes; l += static_cast<int>(padding))
      pass.work.screen(static_cast<std::int64_t>(first) + l, l, static_cast<int>(padding), s);
    if (pass.work.work() == Work::sample) {
      pass.add_samples(n, s);
      continue;
    }
    if (pass.gathers_only()) continue;
    pass.work.weigh_stress(n, s);
    for (int l = 0; l < n; ++l) {
      Row S[D];
      for (int e = 0; e < D; ++e) {
        S[e] = Row{};
        for (int c = 0; c < D; ++c) S[e][c] = s.P[(c * D + e) * batch_points + l];
      }
      const std::size_t p = first + static_cast<std::size_t>(l);
      gradient_.times_transposed(p, S, &flux_[D * p]);
      if (gradient_.shifted()) gradient_.keep_stress(p, S, &stress_[D * p]);
    }
  }
}

template <int D>
void CloudPoints<D>::run(Pass& pass) {
  scratch_.prepare(laws_, pass.work.laminates());
  ArrivingRows arrival(pieces_, pass.u, u_, pass.arrival);
  if (pass.work.tangent()) mirror_rows(pass.w, points_, w_);
  if (pass.everywhere())
    quiet_.wake();
  else
    quiet_.look(2, [&](std::size_t b) { return blocks_.moves(pass.u, b); }, &arrival);
  sequence_.for_each(
      [&](std::size_t b) {
        if (quiet_.begins(b)) block(b, pass);
      },
      &arrival);
  if (pass.bad >= 0 || pass.gathers_only()) return;
  parallel_for(blocks_.count(), [&](std::size_t b) {
    if (!quiet_.awake(b, 2)) return;
    for (std::size_t p = blocks_.begin(b); p < blocks_.end(b); ++p) {
      if (!pass.gradient_wanted(static_cast<std::int64_t>(p))) continue;  // also what others than `only` feel of these
      const Row f = gradient_.divergence(p, flux_, stress_);
      for (int c = 0; c < D; ++c) pass.out.component(c)[p] += f[c];
    }
  });
}

template <int D>
void CloudPoints<D>::bonds_changed(std::span<const std::int32_t> points) {
  for (const std::int32_t p : points) gradient_.renew(static_cast<std::size_t>(p));
}

template <int D>
void CloudPoints<D>::shift_gradients(ConstFieldView lambda) {
  gradient_.shift(lambda);
  stress_.assign(D * points_, Row{});
}

template <int D>
void CloudPoints<D>::report(ModelReport& report) const {
  report.evaluation_points += points_;
  report.bytes += gradient_.bytes() + (u_.size() + w_.size() + flux_.size() + stress_.size()) * sizeof(Row) + scratch_.bytes();
}

template class CloudPoints<1>;
template class CloudPoints<2>;
template class CloudPoints<3>;

}  // namespace perikit
