#pragma once
/// The bond shape: H_b = A (I - xi (x) g) + u_b (x) g, and its adjoint, on arrays over bonds of stride batch_points.

#include "perikit/core/simd.hpp"
#include "perikit/engine/laws.hpp"

namespace perikit {

/// Bond vectors and corrections: one per lane, or one per slot of `padding` lanes (whole lattice families).
struct BondVectors {
  const double* xi[3];
  const double* g[3];
  bool per_slot;
};

template <bool per_slot>
inline Pack bond_value(const double* x, int lane) noexcept {
  if constexpr (per_slot) return Pack(x[lane / static_cast<int>(padding)]);
  else return Pack::load(x + lane);
}

/// H from A = (Hbar_i + Hbar_j)/2 or Hbar_i, and u_b = u_j - u_i. H has D*D components; lateral components are left alone.
template <int D, bool per_slot>
void bond_gradient(int lanes, const BondVectors& v, const double* A, const double* du, double* H) noexcept {
  for (int l = 0; l < lanes; l += pack_width) {
    Pack xi[D], g[D];
    for (int e = 0; e < D; ++e) {
      xi[e] = bond_value<per_slot>(v.xi[e], l);
      g[e] = bond_value<per_slot>(v.g[e], l);
    }
    for (int c = 0; c < D; ++c) {
      Pack a[D];
      Pack z = Pack::load(du + c * batch_points + l);
      for (int e = 0; e < D; ++e) {
        a[e] = Pack::load(A + (c * D + e) * batch_points + l);
        z -= a[e] * xi[e];
      }
      for (int e = 0; e < D; ++e) (a[e] + z * g[e]).store(H + (c * D + e) * batch_points + l);
    }
  }
}

/// t = WP g (on u_b) and S = WP - t (x) xi (on A), from the weighted stress WP. S may be the array of WP.
template <int D, bool per_slot>
void bond_adjoint(int lanes, const BondVectors& v, const double* WP, double* t, double* S) noexcept {
  for (int l = 0; l < lanes; l += pack_width) {
    for (int c = 0; c < D; ++c) {
      Pack p[D];
      Pack force(0.0);
      for (int e = 0; e < D; ++e) {
        p[e] = Pack::load(WP + (c * D + e) * batch_points + l);
        force += p[e] * bond_value<per_slot>(v.g[e], l);
      }
      force.store(t + c * batch_points + l);
      for (int e = 0; e < D; ++e) (p[e] - force * bond_value<per_slot>(v.xi[e], l)).store(S + (c * D + e) * batch_points + l);
    }
  }
}

}  // namespace perikit
