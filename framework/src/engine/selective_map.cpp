#include "selective_map.hpp"

#include <limits>

#include "perikit/core/simd_math.hpp"
#include "perikit/core/tensor.hpp"
#include "perikit/engine/laws.hpp"

namespace perikit {

namespace {

template <class S>
Tensor<Pack, S> load_in_space(const double* x, std::size_t stride) noexcept {
  constexpr int d = S::dimension;
  return Tensor<Pack, S>::map([&](int c) { return c < d * d ? Pack::load(x + static_cast<std::size_t>(c) * stride) : Pack(0.0); });
}

template <class S>
Tensor<Pack, S> load(const double* x) noexcept {
  return Tensor<Pack, S>::map([&](int c) { return Pack::load(x + c * batch_points); });
}

/// F^-T = cof F / det F.
template <class S>
Tensor<Pack, S> inverse_transpose(const Tensor<Pack, S>& H) noexcept {
  return Pack(1.0) / (jacobian_minus_one(H) + Pack(1.0)) * cofactor(add_diagonal(H, Pack(1.0)));
}

Pack positive_or_nan(Pack x) noexcept {
  return select(x > Pack(0.0), x, Pack(std::numeric_limits<double>::quiet_NaN()));
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
[[gnu::flatten]] void add_stress(const OwnerGradients& in, const double* pressure, const double* rate, double* out, std::size_t stride) noexcept {
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

/// a - 1 = cbrt(1 + r) - 1 = r / (a^2 + a + 1) with r = Jbar/Jt - 1: exactly 0 at rest, no digits lost near it.
struct Growth {
  const double* volume;
  Pack jt, inverse, root;   ///< Jt - 1, 1/Jt, Jt^(-1/3)
  Pack operator()(int at) const noexcept {
    const Pack r = (Pack::load(volume + volume_jacobian * batch_points + at) - jt) * inverse;
    const Pack a = Pack::load(volume + volume_root * batch_points + at) * root;
    return Pack::load(volume + volume_regular * batch_points + at) * (r * reciprocal(a * a + a + Pack(1.0)));
  }
};

/// phi = (tr Fbar^-1 dFbar - tr Ft^-1 dFt) / 3, so that da = a phi.
Pack growth_rate(const double* volume, int at, Pack rate) noexcept {
  return Pack(1.0 / 3.0) * Pack::load(volume + volume_regular * batch_points + at) * (Pack::load(volume + volume_rate * batch_points + at) - rate);
}

template <class S>
[[gnu::flatten]] void map(const SelectiveBatch& in, double* H, double* dH) noexcept {
  for (int l = 0; l < in.lanes; l += pack_width) {
    const auto Ht = load_in_space<S>(in.Ht + l, batch_points), Ft = add_diagonal(Ht, Pack(1.0));
    const Pack jt = jacobian_minus_one(Ht), J = positive_or_nan(jt + Pack(1.0)), inverse = reciprocal(J);
    inverse.store(in.inverse + l);
    const Growth growth{in.volume, jt, inverse, reciprocal_cbrt(J)};
    for (int at = l; at < in.ends * in.lanes; at += in.lanes) {
      const Pack grow = growth(at);
      grow.store(in.growth + at);
      const auto Hh = Ht + grow * Ft;
      for (int c = 0; c < S::components; ++c) Hh[c].store(H + c * batch_points + at);
    }
    if (!in.dHt) continue;
    const auto dFt = load_in_space<S>(in.dHt + l, batch_points);
    const Pack rate = inverse * inner(cofactor(Ft), dFt);
    for (int at = l; at < in.ends * in.lanes; at += in.lanes) {
      const auto dFh = (Pack::load(in.growth + at) + Pack(1.0)) * (dFt + growth_rate(in.volume, at, rate) * Ft);
      for (int c = 0; c < S::components; ++c) dFh[c].store(dH + c * batch_points + at);
    }
  }
}

template <class S>
[[gnu::flatten]] void pull_back(const SelectiveBatch& in, const SelectiveStress& stress) noexcept {
  for (int l = 0; l < in.lanes; l += pack_width) {
    const auto Ft = add_diagonal(load_in_space<S>(in.Ht + l, batch_points), Pack(1.0));
    const auto Ftm = Pack::load(in.inverse + l) * cofactor(Ft);
    auto sum = Tensor<Pack, S>::map([](int) { return Pack(0.0); });
    Pack sum_p(0.0), sum_dp(0.0);
    for (int end = 0; end < in.ends; ++end) {
      const int at = end * in.lanes + l;
      const auto P = load<S>(stress.P + at);
      const Pack weight = Pack(stress.sign) * Pack::load(stress.weight[end] + l), a = Pack::load(in.growth + at) + Pack(1.0);
      const Pack share = Pack(1.0 / 3.0) * weight * Pack::load(in.volume + volume_regular * batch_points + at);
      const Pack p = share * (a * inner(P, Ft));
      p.store(stress.pressure + at);
      sum_p += p;
      if (!in.dHt) {
        sum = sum + (weight * a) * P;
        continue;
      }
      // d(a P - p/3 F^-T) = a (dP + phi P) - dp/3 F^-T + p/3 F^-T dF^T F^-T
      const auto dFt = load_in_space<S>(in.dHt + l, batch_points), dP = load<S>(stress.dP + at);
      const Pack phi = growth_rate(in.volume, at, inner(Ftm, dFt));
      const Pack dp = share * (a * (inner(dP, Ft) + inner(P, dFt + phi * Ft)));
      dp.store(stress.pressure_rate + at);
      sum_dp += dp;
      sum = sum + (weight * a) * (dP + phi * P);
    }
    sum = sum - (in.dHt ? sum_dp : sum_p) * Ftm;
    if (in.dHt) sum = sum + sum_p * (Ftm * transpose_times(load_in_space<S>(in.dHt + l, batch_points), Ftm));
    for (int c = 0; c < S::dimension * S::dimension; ++c) sum[c].store(stress.S + c * batch_points + l);
  }
}

/// f of the tensors of this space.
template <class F>
void in_space(Space space, const F& f) noexcept {
  switch (dimension(space)) {
    case 1: return f(Line());
    case 2: return f(Plane());
    default: return f(Solid());
  }
}

}  // namespace

void owner_volume(Space space, const OwnerGradients& in, double* volume, std::size_t stride) noexcept {
  in_space(space, [&]<class S>(S) { volume_of<S>(in, volume, stride); });
}

void add_owner_stress(Space space, const OwnerGradients& in, const double* pressure, const double* pressure_rate, double* S, std::size_t stride) noexcept {
  in_space(space, [&]<class T>(T) { add_stress<T>(in, pressure, pressure_rate, S, stride); });
}

void selective_map(Space space, const SelectiveBatch& in, double* H, double* dH) noexcept {
  in_space(space, [&]<class S>(S) { map<S>(in, H, dH); });
}

void selective_pull_back(Space space, const SelectiveBatch& in, const SelectiveStress& stress) noexcept {
  in_space(space, [&]<class S>(S) { pull_back<S>(in, stress); });
}

}  // namespace perikit
