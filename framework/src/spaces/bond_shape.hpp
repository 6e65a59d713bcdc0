#pragma once
/// The bond shape: H_b = A (I - xi (x) g) + u_b (x) g, A = (1 - s) Hbar_i + s Hbar_j, and its adjoint, t = WP g on u_b and WP - t (x) xi on A.
/// The formula stands in families/stencils.hpp; whoever needs it (clouds, lattices, assembly) reads and writes around it.

#include <cstdint>

#include "families/stencils.hpp"
#include "perikit/core/simd.hpp"
#include "perikit/operators/laws.hpp"

namespace perikit {

/// Bond vectors and corrections: one per lane, or one per slot of `padding` lanes (whole lattice families).
struct BondVectors {
  const double* xi[3];
  const double* g[3];
  bool per_slot;

  template <int D>
  void of(int lane, int slot, double (&bond)[D], double (&correction)[D]) const noexcept {
    const int at = per_slot ? slot : lane;
    for (int e = 0; e < D; ++e) {
      bond[e] = xi[e][at];
      correction[e] = g[e][at];
    }
  }
};

template <bool per_slot>
inline Pack bond_value(const double* x, int lane) noexcept {
  if constexpr (per_slot) return Pack(x[lane / static_cast<int>(padding)]);
  else return Pack::load(x + lane);
}

/// Bits of the lanes l ... l + pack_width - 1 of a mask.
inline std::uint8_t pack_mask(std::uint8_t mask, int l) noexcept {
  return static_cast<std::uint8_t>(mask >> l & ((1u << pack_width) - 1));
}

/// Lattices: H of `slots` bonds of each of the eight points p ... p + 7, straight from the fields, lanes slot by slot.
/// masks[k]: lanes whose far end is live; H is zero in the others. both: A = (1 - far_share) Hbar_i + far_share Hbar_j, else Hbar_i.
template <int D, bool per_slot, bool both>
void lattice_bond_gradient(const std::int64_t* shifts, const std::uint8_t* masks, int slots, std::int64_t p, const BondVectors& v,
                           double far_share, ConstFieldView u, ConstFieldView Hbar, double* H) noexcept {
  const Pack near(both ? 1 - far_share : 1.0), other(far_share);
  for (int l = 0; l < static_cast<int>(padding); l += pack_width) {
    Pack own_u[D], own_H[D * D];
    for (int c = 0; c < D; ++c) own_u[c] = Pack::load(u.component(c) + p + l);
    for (int c = 0; c < D * D; ++c) own_H[c] = near * Pack::load(Hbar.component(c) + p + l);
    for (int k = 0; k < slots; ++k) {
      const std::uint8_t mask = pack_mask(masks[k], l);
      const bool whole = mask == pack_mask(0xff, 0);
      const std::int64_t far = p + shifts[k] + l;
      const int lane = k * static_cast<int>(padding) + l;
      if (mask == 0) {
        for (int c = 0; c < D * D; ++c) Pack(0.0).store(H + c * batch_points + lane);
        continue;
      }
      Pack xi[D], g[D];
      for (int e = 0; e < D; ++e) {
        xi[e] = bond_value<per_slot>(v.xi[e], lane);
        g[e] = bond_value<per_slot>(v.g[e], lane);
      }
      for (int c = 0; c < D; ++c) {
        Pack a[D], h[D];
        for (int e = 0; e < D; ++e) {
          a[e] = own_H[c * D + e];
          if constexpr (both) a[e] += other * Pack::load(Hbar.component(c * D + e) + far);
        }
        bond_shape_row<D>(a, Pack::load(u.component(c) + far) - own_u[c], xi, g, h);
        for (int e = 0; e < D; ++e) (whole ? h[e] : keep(mask, h[e])).store(H + (c * D + e) * batch_points + lane);
      }
    }
  }
}

/// to[lanes of mask] += value; other cells are not touched.
inline void add_to_cells(double* to, Pack value, std::uint8_t mask) noexcept {
  if (mask == pack_mask(0xff, 0)) (Pack::load(to) + value).store(to);
  else subtract_at(to, mask, -value);
}

/// The adjoint of lattice_bond_gradient: adds t = WP g to the owners' forces and -t to the far ends', S = WP - t (x) xi to the
/// stress on Hbar of the owners (and of the far ends). masks[k]: lanes whose far end is live; only live cells are written. W: by lane; not read
/// unless `weighs`: P is weighted already.
template <int D, bool per_slot, bool both, bool weighs>
void lattice_bond_adjoint(const std::int64_t* shifts, const std::uint8_t* masks, int slots, std::int64_t p, const BondVectors& v,
                          double far_share, const double* P, const double* W, FieldView force, FieldView stress) noexcept {
  const Pack near(both ? 1 - far_share : 1.0), other(far_share);
  constexpr int packs = static_cast<int>(padding) / pack_width;
  // Bond by bond for all eight points, so that what a far end gets comes in the same order whatever the width of a pack is. Every loop over
  // components is unrolled whole: sums of the owners stay in registers.
  Pack own_t[packs][D], own_S[packs][D * D];
  for (int k = 0; k < slots; ++k) {
    PERIKIT_UNROLL for (int i = 0; i < packs; ++i) {
      const int l = i * pack_width;
      const std::uint8_t mask = pack_mask(masks[k], l);
      if (mask == 0) continue;
      const std::int64_t far = p + shifts[k] + l;
      const int lane = k * static_cast<int>(padding) + l;
      Pack t[D], S[D * D], xi[D], g[D];
      PERIKIT_UNROLL for (int e = 0; e < D; ++e) {
        xi[e] = bond_value<per_slot>(v.xi[e], lane);
        g[e] = bond_value<per_slot>(v.g[e], lane);
      }
      PERIKIT_UNROLL for (int c = 0; c < D; ++c) {
        Pack row[D];
        PERIKIT_UNROLL for (int e = 0; e < D; ++e) {
          row[e] = Pack::load(P + (c * D + e) * batch_points + lane);
          if constexpr (weighs) row[e] = Pack::load(W + lane) * row[e];
        }
        t[c] = bond_shape_row_adjoint<D>(row, xi, g);
        own_t[i][c] += t[c];
        PERIKIT_UNROLL for (int e = 0; e < D; ++e) own_S[i][c * D + e] += near * (S[c * D + e] = row[e]);
      }
      const auto scatter = [&](auto&& add) {
        PERIKIT_UNROLL for (int c = 0; c < D; ++c) add(force.component(c) + far, -t[c]);
        if constexpr (both) {
          PERIKIT_UNROLL for (int c = 0; c < D * D; ++c) add(stress.component(c) + far, other * S[c]);
        }
      };
      if (mask == pack_mask(0xff, 0)) scatter([](double* to, Pack value) { (Pack::load(to) + value).store(to); });
      else scatter([&](double* to, Pack value) { subtract_at(to, mask, -value); });
    }
  }
  PERIKIT_UNROLL for (int i = 0; i < packs; ++i) {
    const std::int64_t own = p + i * pack_width;
    PERIKIT_UNROLL for (int c = 0; c < D; ++c) (Pack::load(force.component(c) + own) + own_t[i][c]).store(force.component(c) + own);
    PERIKIT_UNROLL for (int c = 0; c < D * D; ++c) (Pack::load(stress.component(c) + own) + own_S[i][c]).store(stress.component(c) + own);
  }
}

}  // namespace perikit
