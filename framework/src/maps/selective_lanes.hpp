#pragma once
/// What the selective map and its laws do with the lanes of a batch.

#include <limits>

#include "maps/selective_map.hpp"
#include "perikit/core/simd_math.hpp"
#include "perikit/core/tensor.hpp"
#include "perikit/operators/laws.hpp"

namespace perikit {

template <class S>
Tensor<Pack, S> load_in_space(const double* x, std::size_t stride) noexcept {
  constexpr int d = S::dimension;
  return Tensor<Pack, S>::map(
      [&](int c) { return c < d * d ? Pack::load(x + static_cast<std::size_t>(c) * stride) : Pack(0.0); });
}

template <class S>
Tensor<Pack, S> load(const double* x) noexcept {
  return Tensor<Pack, S>::map([&](int c) { return Pack::load(x + c * batch_points); });
}

inline Pack positive_or_nan(Pack x) noexcept {
  return select(x > Pack(0.0), x, Pack(std::numeric_limits<double>::quiet_NaN()));
}

inline Pack load_volume(const OwnerVolumes& owners, int component, int at) noexcept {
  constexpr int group = static_cast<int>(padding);
  return Pack::load(owners.data + static_cast<std::size_t>(component) * owners.stride + owners.group[at / group] + at % group);
}

/// c
inline Pack share_of(const OwnerVolumes& owners, int at) noexcept { return owners.whole ? Pack(1.0) : load_volume(owners, volume_share, at); }

/// a - 1 = c (cbrt(1 + r) - 1) = c r / (q^2 + q + 1) with r = Jbar/Jt - 1, q = cbrt(1 + r): exactly 0 at rest, no digits lost near it.
struct Growth {
  Pack jt, inverse, root;  ///< Jt - 1, 1/Jt, Jt^(-1/3)
  Pack operator()(const OwnerVolumes& owners, int at) const noexcept {
    const Pack r = (load_volume(owners, volume_jacobian, at) - jt) * inverse, q = load_volume(owners, volume_root, at) * root;
    const Pack growth = r * reciprocal(q * q + q + Pack(1.0));
    return owners.whole ? growth : load_volume(owners, volume_share, at) * growth;
  }
};

/// phi = (tr Fbar^-1 dFbar - tr Ft^-1 dFt) / 3, so that da = m phi with m = c q = a - 1 + c.
inline Pack growth_rate(const OwnerVolumes& owners, int at, Pack rate) noexcept {
  return Pack(1.0 / 3.0) * (load_volume(owners, volume_rate, at) - rate);
}

/// in.inverse and in.growth, and jt <- Jt - 1 by lane. In loops of their own: lanes that wait for a root and for a division after it would hold up
/// the many components of those that follow.
template <class S, int ends>
[[gnu::flatten]] void find_growth(const SelectiveBatch in, double* jt) noexcept {
  alignas(64) double root[batch_points];
  for (int l = 0; l < in.lanes; l += pack_width) jacobian_minus_one(load_in_space<S>(in.Ht + l, batch_points)).store(jt + l);
  for (int l = 0; l < in.lanes; l += pack_width) {
    const Pack J = positive_or_nan(Pack::load(jt + l) + Pack(1.0));
    reciprocal(J).store(in.inverse + l);
    reciprocal_cbrt(J).store(root + l);
  }
  for (int l = 0; l < in.lanes; l += pack_width) {
    const Growth growth{Pack::load(jt + l), Pack::load(in.inverse + l), Pack::load(root + l)};
    for (int at = l; at < ends * in.lanes; at += in.lanes) growth(in.volume, at).store(in.growth + at);
  }
}

/// f of the tensors of this space.
template <class F>
void in_space(Space space, const F& f) noexcept {
  switch (dimension(space)) {
    case 1:
      return f(Line());
    case 2:
      return f(Plane());
    default:
      return f(Solid());
  }
}

}  // namespace perikit
