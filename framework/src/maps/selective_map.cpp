#include "maps/selective_map.hpp"

#include "maps/selective_lanes.hpp"

namespace perikit {

namespace {

/// F^-T = cof F / det F.
template <class S>
Tensor<Pack, S> inverse_transpose(const Tensor<Pack, S>& H) noexcept {
  return Pack(1.0) / (jacobian_minus_one(H) + Pack(1.0)) * cofactor(add_diagonal(H, Pack(1.0)));
}

template <class S>
[[gnu::flatten]] void volume_of(const OwnerGradients& in, double* volume, std::size_t stride) noexcept {
  for (int l = 0; l < in.n; l += pack_width) {
    const auto H = load_in_space<S>(in.H + l, in.stride);
    const Pack j = jacobian_minus_one(H);
    j.store(volume + volume_jacobian * stride + l);
    cbrt(positive_or_nan(j + Pack(1.0))).store(volume + volume_root * stride + l);
    if (in.dH) inner(inverse_transpose(H), load_in_space<S>(in.dH + l, in.stride)).store(volume + volume_rate * stride + l);
  }
}

template <class S>
[[gnu::flatten]] void add_stress(const OwnerGradients& in, const double* pressure, const double* rate, double* out,
                                 std::size_t stride) noexcept {
  for (int l = 0; l < in.n; l += pack_width) {
    const auto Fm = inverse_transpose(load_in_space<S>(in.H + l, in.stride));
    const Pack p = Pack::load(pressure + l);
    auto stress = p * Fm;
    // d(p/3 F^-T) = dp/3 F^-T - p/3 F^-T dF^T F^-T
    if (in.dH) stress = Pack::load(rate + l) * Fm - p * (Fm * transpose_times(load_in_space<S>(in.dH + l, in.stride), Fm));
    for (int c = 0; c < S::dimension * S::dimension; ++c) {
      double* to = out + static_cast<std::size_t>(c) * stride + l;
      (Pack::load(to) + stress[c]).store(to);
    }
  }
}

// Batches by value, here and below: a pack that is stored may be any member of what others see, which would be read again for every component.
template <class S, bool tangent, int ends>
[[gnu::flatten]] void map(const SelectiveBatch in, double* H, double* dH) noexcept {
  alignas(64) double jt[batch_points];
  find_growth<S, ends>(in, jt);
  for (int l = 0; l < in.lanes; l += pack_width) {
    const auto Ht = load_in_space<S>(in.Ht + l, batch_points), Ft = add_diagonal(Ht, Pack(1.0));
    for (int at = l; at < ends * in.lanes; at += in.lanes) {
      const Pack grow = Pack::load(in.growth + at);
      PERIKIT_UNROLL for (int c = 0; c < S::components; ++c)(Ht[c] + grow * Ft[c]).store(H + c * batch_points + at);
    }
    if constexpr (tangent) {
      const auto dFt = load_in_space<S>(in.dHt + l, batch_points);
      const Pack rate = Pack::load(in.inverse + l) * inner(cofactor(Ft), dFt);
      for (int at = l; at < ends * in.lanes; at += in.lanes) {
        const Pack grow = Pack::load(in.growth + at), m = grow + share_of(in.volume, at);
        const auto dFh = (grow + Pack(1.0)) * dFt + (m * growth_rate(in.volume, at, rate)) * Ft;
        PERIKIT_UNROLL for (int c = 0; c < S::components; ++c) dFh[c].store(dH + c * batch_points + at);
      }
    }
  }
}

/// What the pull-backs of forces and tangents share: a, m, W and W m/3 of one end.
struct EndOfBond {
  Pack growth, a, m, weight, share;
  EndOfBond(const SelectiveBatch& in, const SelectiveStress& stress, int end, int l) noexcept
      : growth(Pack::load(in.growth + end * in.lanes + l)),
        a(growth + Pack(1.0)),
        m(in.volume.whole ? a : growth + share_of(in.volume, end * in.lanes + l)),
        weight(Pack(stress.sign) * Pack::load(stress.weight[end] + l)),
        share(Pack(1.0 / 3.0) * weight * m) {}
};

template <class S>
void store_in_space(const Tensor<Pack, S>& t, double* x) noexcept {
  PERIKIT_UNROLL for (int c = 0; c < S::dimension * S::dimension; ++c) t[c].store(x + c * batch_points);
}

template <class S, int ends>
[[gnu::flatten]] void pull_back(const SelectiveBatch in, const SelectiveStress stress) noexcept {
  for (int l = 0; l < in.lanes; l += pack_width) {
    const auto Ft = add_diagonal(load_in_space<S>(in.Ht + l, batch_points), Pack(1.0));
    Pack factor[ends], sum_p(0.0);
    PERIKIT_UNROLL for (int end = 0; end < ends; ++end) {
      const EndOfBond bond(in, stress, end, l);
      const Pack p = bond.share * inner(load<S>(stress.P + end * in.lanes + l), Ft);
      p.store(stress.pressure + end * in.lanes + l);
      factor[end] = bond.weight * bond.a;
      sum_p += p;
    }
    const auto turned = (sum_p * Pack::load(in.inverse + l)) * cofactor(Ft);
    // P once more: sixteen registers do not hold its two ends.
    PERIKIT_UNROLL for (int c = 0; c < S::dimension * S::dimension; ++c) {
      Pack sum = -turned[c];
      PERIKIT_UNROLL for (int end = 0; end < ends; ++end) sum += factor[end] * Pack::load(stress.P + c * batch_points + end * in.lanes + l);
      sum.store(stress.S + c * batch_points + l);
    }
  }
}

/// d(a P - p/3 F^-T) = a dP + m phi P - dp/3 F^-T + p/3 F^-T dF^T F^-T
template <class S, int ends>
[[gnu::flatten]] void pull_back_tangent(const SelectiveBatch in, const SelectiveStress stress) noexcept {
  for (int l = 0; l < in.lanes; l += pack_width) {
    const auto Ft = add_diagonal(load_in_space<S>(in.Ht + l, batch_points), Pack(1.0)),
               dFt = load_in_space<S>(in.dHt + l, batch_points);
    const auto Ftm = Pack::load(in.inverse + l) * cofactor(Ft);
    auto sum = Tensor<Pack, S>::map([](int) { return Pack(0.0); });
    Pack sum_p(0.0), sum_dp(0.0);
    for (int end = 0; end < ends; ++end) {
      const int at = end * in.lanes + l;
      const EndOfBond bond(in, stress, end, l);
      const auto P = load<S>(stress.P + at), dP = load<S>(stress.dP + at);
      const Pack phi = growth_rate(in.volume, at, inner(Ftm, dFt));
      const Pack p = bond.share * inner(P, Ft), dp = bond.share * (inner(dP, Ft) + inner(P, dFt + phi * Ft));
      p.store(stress.pressure + at);
      dp.store(stress.pressure_rate + at);
      sum_p += p;
      sum_dp += dp;
      sum = sum + bond.weight * (bond.a * dP + (bond.m * phi) * P);
    }
    store_in_space(sum - sum_dp * Ftm + sum_p * (Ftm * transpose_times(dFt, Ftm)), stress.S + l);
  }
}

}  // namespace

void owner_volume(Space space, const OwnerGradients& in, double* volume, std::size_t stride) noexcept {
  in_space(space, [&]<class S>(S) { volume_of<S>(in, volume, stride); });
}

void add_owner_stress(Space space, const OwnerGradients& in, const double* pressure, const double* pressure_rate, double* S,
                      std::size_t stride) noexcept {
  in_space(space, [&]<class T>(T) { add_stress<T>(in, pressure, pressure_rate, S, stride); });
}

void selective_map(Space space, const SelectiveBatch& in, double* H, double* dH) noexcept {
  in_space(space, [&]<class S>(S) {
    if (in.ends == 1) in.dHt ? map<S, true, 1>(in, H, dH) : map<S, false, 1>(in, H, dH);
    else in.dHt ? map<S, true, 2>(in, H, dH) : map<S, false, 2>(in, H, dH);
  });
}

void selective_pull_back(Space space, const SelectiveBatch& in, const SelectiveStress& stress) noexcept {
  in_space(space, [&]<class S>(S) {
    if (in.ends == 1) in.dHt ? pull_back_tangent<S, 1>(in, stress) : pull_back<S, 1>(in, stress);
    else in.dHt ? pull_back_tangent<S, 2>(in, stress) : pull_back<S, 2>(in, stress);
  });
}

}  // namespace perikit
