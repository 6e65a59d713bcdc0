#include "selective_map.hpp"

#include <limits>

#include "perikit/core/simd_math.hpp"
#include "perikit/core/tensor.hpp"
#include "perikit/engine/laws.hpp"

namespace perikit {

namespace {

template <class S>
Tensor<Pack, S> load_in_space(const double* x, int lane) noexcept {
  constexpr int d = S::dimension;
  return Tensor<Pack, S>::map([&](int c) { return c < d * d ? Pack::load(x + c * batch_points + lane) : Pack(0.0); });
}

template <class S>
void store_in_space(const Tensor<Pack, S>& t, double* x, int lane) noexcept {
  constexpr int d = S::dimension;
  for (int c = 0; c < d * d; ++c) t[c].store(x + c * batch_points + lane);
}

/// F^-T = cof F / det F.
template <class S>
Tensor<Pack, S> inverse_transpose(const Tensor<Pack, S>& H) noexcept {
  const Tensor<Pack, S> F = add_diagonal(H, Pack(1.0));
  return Pack(1.0) / (jacobian_minus_one(H) + Pack(1.0)) * cofactor(F);
}

/// a - 1 = cbrt(1 + r) - 1 = r / (a^2 + a + 1) with r = Jbar/Jt - 1: exactly 0 at rest, no digits lost near it. NaN where r < -1.
template <class S>
Pack scaling_minus_one(const Tensor<Pack, S>& Ht, const Tensor<Pack, S>& Hbar) noexcept {
  const Pack jt = jacobian_minus_one(Ht), jbar = jacobian_minus_one(Hbar);
  const Pack r = (jbar - jt) / (jt + Pack(1.0));
  const Pack a = cbrt(r + Pack(1.0));
  const Pack bad = select((jt > Pack(-1.0)) & (jbar > Pack(-1.0)), Pack(0.0), Pack(std::numeric_limits<double>::quiet_NaN()));
  return r / (a * a + a + Pack(1.0)) + bad;
}

/// phi = (tr Fbar^-1 dFbar - tr Ft^-1 dFt) / 3, so that da = a phi.
template <class S>
Pack scaling_rate(const Tensor<Pack, S>& Ftm, const Tensor<Pack, S>& Fbm, const Tensor<Pack, S>& dFt, const Tensor<Pack, S>& dFbar) noexcept {
  return (inner(Fbm, dFbar) - inner(Ftm, dFt)) * Pack(1.0 / 3.0);
}

template <class S>
[[gnu::flatten]] void map(int lanes, const SelectiveArrays& in, double* H, double* dH) noexcept {
  for (int l = 0; l < lanes; l += pack_width) {
    const auto Ht = load_in_space<S>(in.Ht, l), Hbar = load_in_space<S>(in.Hbar, l);
    const Pack grow = scaling_minus_one(Ht, Hbar);
    grow.store(in.scale + l);
    const auto Ft = add_diagonal(Ht, Pack(1.0));
    const auto Hh = Ht + grow * Ft;
    for (int c = 0; c < S::components; ++c) Hh[c].store(H + c * batch_points + l);
    if (!in.dHt) continue;
    const auto dFt = load_in_space<S>(in.dHt, l), dFbar = load_in_space<S>(in.dHbar, l);
    const Pack phi = scaling_rate(inverse_transpose(Ht), inverse_transpose(Hbar), dFt, dFbar);
    const auto dFh = (grow + Pack(1.0)) * (dFt + phi * Ft);
    for (int c = 0; c < S::components; ++c) dFh[c].store(dH + c * batch_points + l);
  }
}

template <class S>
[[gnu::flatten]] void pull_back(int lanes, const SelectiveArrays& in, const double* P, const double* dP, double* S_own, double* S_bar) noexcept {
  for (int l = 0; l < lanes; l += pack_width) {
    const auto load = [&](const double* x) { return Tensor<Pack, S>::map([&](int c) { return Pack::load(x + c * batch_points + l); }); };
    const auto Ht = load_in_space<S>(in.Ht, l), Hbar = load_in_space<S>(in.Hbar, l);
    const auto Ph = load(P);
    const Pack a = Pack::load(in.scale + l) + Pack(1.0);
    const auto Fh = a * add_diagonal(Ht, Pack(1.0));
    const auto Ftm = inverse_transpose(Ht), Fbm = inverse_transpose(Hbar);
    const Pack p = inner(Ph, Fh), third(1.0 / 3.0);
    if (!in.dHt) {
      store_in_space(a * Ph - p * third * Ftm, S_own, l);
      store_in_space(p * third * Fbm, S_bar, l);
      continue;
    }
    const auto dFt = load_in_space<S>(in.dHt, l), dFbar = load_in_space<S>(in.dHbar, l);
    const auto dPh = load(dP);
    const Pack phi = scaling_rate(Ftm, Fbm, dFt, dFbar);
    const auto dFh = a * (dFt + phi * add_diagonal(Ht, Pack(1.0)));
    const Pack dp = inner(dPh, Fh) + inner(Ph, dFh);
    store_in_space(a * (dPh + phi * Ph) - dp * third * Ftm + p * third * (Ftm * transpose_times(dFt, Ftm)), S_own, l);
    store_in_space(dp * third * Fbm - p * third * (Fbm * transpose_times(dFbar, Fbm)), S_bar, l);
  }
}

}  // namespace

void selective_map(Space space, int lanes, const SelectiveArrays& in, double* H, double* dH) noexcept {
  switch (dimension(space)) {
    case 1: return map<Line>(lanes, in, H, dH);
    case 2: return map<Plane>(lanes, in, H, dH);
    default: return map<Solid>(lanes, in, H, dH);
  }
}

void selective_pull_back(Space space, int lanes, const SelectiveArrays& in, const double* P, const double* dP, double* S_own, double* S_bar) noexcept {
  switch (dimension(space)) {
    case 1: return pull_back<Line>(lanes, in, P, dP, S_own, S_bar);
    case 2: return pull_back<Plane>(lanes, in, P, dP, S_own, S_bar);
    default: return pull_back<Solid>(lanes, in, P, dP, S_own, S_bar);
  }
}

}  // namespace perikit
