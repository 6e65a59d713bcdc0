#include "maps/selective_laws.hpp"

#include "maps/selective_lanes.hpp"

namespace perikit {

namespace {

// Batches by value, as in selective_map.cpp.
template <class S, int ends>
[[gnu::flatten]] void volumes(const SelectiveBatch in, double* j) noexcept {
  if (in.volume.whole) {
    for (int at = 0; at < ends * in.lanes; at += pack_width) load_volume(in.volume, volume_jacobian, at).store(j + at);
    return;
  }
  alignas(64) double jt[batch_points];
  find_growth<S, ends>(in, jt);
  for (int l = 0; l < in.lanes; l += pack_width) {
    const Pack own = Pack::load(jt + l);
    for (int at = l; at < ends * in.lanes; at += in.lanes) {
      const Pack grow = Pack::load(in.growth + at);
      const Pack grown = own + grow * (Pack(3.0) + grow * (Pack(3.0) + grow)) * (own + Pack(1.0));
      // The same bits as where all shares are whole.
      select(share_of(in.volume, at) == Pack(1.0), load_volume(in.volume, volume_jacobian, at), grown).store(j + at);
    }
  }
}

template <int ends>
[[gnu::flatten]] void whole_pressures(const SelectiveBatch in, const VolumetricStress stress) noexcept {
  for (int end = 0; end < ends; ++end)
    for (int l = 0; l < in.lanes; l += pack_width) {
      const int at = end * in.lanes + l;
      const Pack weight = Pack(stress.sign) * Pack::load(stress.weight[end] + l);
      (weight * Pack::load(stress.kirchhoff + at)).store(stress.pressure + at);
      if (stress.slope) (weight * (Pack::load(stress.slope + at) * load_volume(in.volume, volume_rate, at))).store(stress.pressure_rate + at);
    }
}

/// With r = 1 - m/a = (1 - c)/a and dJh/Jh = (m/a) tr(Fbar^-1 dFbar) + r tr(Ft^-1 dFt); dr = -r (m/a) phi, phi of growth_rate.
template <class S, bool tangent, int ends>
[[gnu::flatten]] void pull_back_volumes(const SelectiveBatch in, const VolumetricStress stress) noexcept {
  for (int l = 0; l < in.lanes; l += pack_width) {
    const auto Ft = add_diagonal(load_in_space<S>(in.Ht + l, batch_points), Pack(1.0));
    const auto Ftm = Pack::load(in.inverse + l) * cofactor(Ft);
    Tensor<Pack, S> dFt;
    Pack own_rate(0.0), sum_weight(0.0), sum_tau(0.0), sum_rate(0.0);
    if constexpr (tangent) {
      dFt = load_in_space<S>(in.dHt + l, batch_points);
      own_rate = inner(Ftm, dFt);
    }
    PERIKIT_UNROLL for (int end = 0; end < ends; ++end) {
      const int at = end * in.lanes + l;
      const Pack weight = Pack(stress.sign) * Pack::load(stress.weight[end] + l), tau = Pack::load(stress.kirchhoff + at);
      const Pack r = (Pack(1.0) - share_of(in.volume, at)) * reciprocal(Pack::load(in.growth + at) + Pack(1.0)), owners = Pack(1.0) - r;
      (weight * tau * owners).store(stress.pressure + at);
      sum_weight += weight;
      sum_tau += weight * tau * r;
      if constexpr (tangent) {
        const Pack dtau = Pack::load(stress.slope + at) * (owners * load_volume(in.volume, volume_rate, at) + r * own_rate);
        const Pack taken = tau * r * owners * growth_rate(in.volume, at, own_rate);  // by the owner, from the evaluation point
        (weight * (dtau * owners + taken)).store(stress.pressure_rate + at);
        sum_rate += weight * (dtau * r - taken);
      }
    }
    const auto turned = [&] {
      if constexpr (tangent) return sum_rate * Ftm - sum_tau * (Ftm * transpose_times(dFt, Ftm));
      else return sum_tau * Ftm;
    }();
    PERIKIT_UNROLL for (int c = 0; c < S::dimension * S::dimension; ++c) {
      double* const to = stress.S + c * batch_points + l;
      (sum_weight * Pack::load(to) + turned[c]).store(to);
    }
  }
}

/// The coefficients of one end: a P(a F) = alpha P(F) + beta F, and what they grow by where a does.
struct GreenEnd {
  Pack a, e, alpha, beta;
  GreenEnd(Pack growth, Pack kappa) noexcept
      : a(growth + Pack(1.0)), e(growth + Pack(0.5) * growth * growth), alpha(square_of_a() * square_of_a()), beta(Pack(3.0) * kappa * square_of_a() * e) {}
  Pack square_of_a() const noexcept { return Pack(1.0) + Pack(2.0) * e; }
  Pack alpha_rate() const noexcept { return Pack(4.0) * a * square_of_a(); }
  Pack beta_rate(Pack kappa) const noexcept { return Pack(3.0) * kappa * a * (Pack(2.0) * e + square_of_a()); }
};

template <class S, int ends>
[[gnu::flatten]] void add_growth_energy(const SelectiveBatch in, double kappa, double* psi) noexcept {
  for (int l = 0; l < in.lanes; l += pack_width) {
    const auto H = load_in_space<S>(in.Ht + l, batch_points);
    const Pack own = Pack::load(psi + l), strain = trace(H) + Pack(0.5) * inner(H, H);
    for (int at = l; at < ends * in.lanes; at += in.lanes) {
      const GreenEnd end(Pack::load(in.growth + at), Pack(kappa));
      (end.alpha * own + Pack(3.0 * kappa) * end.e * (end.square_of_a() * strain + Pack(1.5) * end.e)).store(psi + at);
    }
  }
}

/// dpsi/dFt = alpha P + beta F - p/3 F^-T, p/3 = (m/3a) (alpha P + beta F) : F, and its derivative, with da = m phi and r = 1 - m/a, dr = -r (m/a) phi.
template <class S, bool tangent, int ends>
[[gnu::flatten]] void pull_back_green(const SelectiveBatch in, double bulk, const SelectiveStress stress) noexcept {
  const Pack kappa(bulk), third(1.0 / 3.0);
  for (int l = 0; l < in.lanes; l += pack_width) {
    const auto F = add_diagonal(load_in_space<S>(in.Ht + l, batch_points), Pack(1.0));
    const auto Fm = Pack::load(in.inverse + l) * cofactor(F);
    const Pack work = inner(load<S>(stress.P + l), F), size = inner(F, F);
    Pack on_P(0.0), on_F(0.0), sum_p(0.0);
    [[maybe_unused]] Tensor<Pack, S> dF;
    [[maybe_unused]] Pack work_rate, size_rate, rate, on_dP(0.0), on_dF(0.0), sum_dp(0.0);
    if constexpr (tangent) {
      dF = load_in_space<S>(in.dHt + l, batch_points);
      work_rate = inner(load<S>(stress.dP + l), F) + inner(load<S>(stress.P + l), dF);
      size_rate = Pack(2.0) * inner(F, dF);
      rate = inner(Fm, dF);
    }
    PERIKIT_UNROLL for (int e = 0; e < ends; ++e) {
      const int at = e * in.lanes + l;
      const GreenEnd end(Pack::load(in.growth + at), kappa);
      const Pack weight = Pack(stress.sign) * Pack::load(stress.weight[e] + l), mean = third * (end.alpha * work + end.beta * size);
      const Pack r = in.volume.whole ? Pack(0.0) : (Pack(1.0) - share_of(in.volume, at)) * reciprocal(end.a), owners = Pack(1.0) - r;
      const Pack p = weight * owners * mean;
      p.store(stress.pressure + at);
      sum_p += p;
      if constexpr (tangent) {
        const Pack phi = growth_rate(in.volume, at, rate), da = owners * end.a * phi;
        const Pack dalpha = end.alpha_rate() * da, dbeta = end.beta_rate(kappa) * da;
        const Pack dmean = third * (dalpha * work + end.alpha * work_rate + dbeta * size + end.beta * size_rate);
        const Pack dp = weight * owners * (dmean + r * phi * mean);
        dp.store(stress.pressure_rate + at);
        sum_dp += dp;
        on_dP += weight * end.alpha;
        on_P += weight * dalpha;
        on_dF += weight * end.beta;
        on_F += weight * dbeta;
      } else {
        on_P += weight * end.alpha;
        on_F += weight * end.beta;
      }
    }
    const auto turned = [&] {
      if constexpr (tangent) return on_dF * dF - sum_dp * Fm + sum_p * (Fm * transpose_times(dF, Fm));
      else return -sum_p * Fm;
    }();
    PERIKIT_UNROLL for (int c = 0; c < S::dimension * S::dimension; ++c) {
      Pack sum = on_P * Pack::load(stress.P + c * batch_points + l) + (on_F * F[c] + turned[c]);
      if constexpr (tangent) sum += on_dP * Pack::load(stress.dP + c * batch_points + l);
      sum.store(stress.S + c * batch_points + l);
    }
  }
}

}  // namespace

void mapped_volumes(Space space, const SelectiveBatch& in, double* j) noexcept {
  in_space(space, [&]<class S>(S) { in.ends == 1 ? volumes<S, 1>(in, j) : volumes<S, 2>(in, j); });
}

bool volumetric_pull_back(Space space, const SelectiveBatch& in, const VolumetricStress& stress) noexcept {
  if (in.volume.whole) {
    in.ends == 1 ? whole_pressures<1>(in, stress) : whole_pressures<2>(in, stress);
    return false;
  }
  in_space(space, [&]<class S>(S) {
    if (in.ends == 1) in.dHt ? pull_back_volumes<S, true, 1>(in, stress) : pull_back_volumes<S, false, 1>(in, stress);
    else in.dHt ? pull_back_volumes<S, true, 2>(in, stress) : pull_back_volumes<S, false, 2>(in, stress);
  });
  return true;
}

void find_growths(Space space, const SelectiveBatch& in) noexcept {
  alignas(64) double jt[batch_points];
  in_space(space, [&]<class S>(S) { in.ends == 1 ? find_growth<S, 1>(in, jt) : find_growth<S, 2>(in, jt); });
}

void map_energies(Space space, const SelectiveBatch& in, double kappa, double* psi) noexcept {
  in_space(space, [&]<class S>(S) { in.ends == 1 ? add_growth_energy<S, 1>(in, kappa, psi) : add_growth_energy<S, 2>(in, kappa, psi); });
}

void green_pull_back(Space space, const SelectiveBatch& in, double kappa, const SelectiveStress& stress) noexcept {
  in_space(space, [&]<class S>(S) {
    if (in.ends == 1) in.dHt ? pull_back_green<S, true, 1>(in, kappa, stress) : pull_back_green<S, false, 1>(in, kappa, stress);
    else in.dHt ? pull_back_green<S, true, 2>(in, kappa, stress) : pull_back_green<S, false, 2>(in, kappa, stress);
  });
}

}  // namespace perikit
