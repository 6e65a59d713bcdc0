#pragma once
/// Products of a local stencil with the displacements of its family, for eight points that share it (a matrix product) or for one.
/// Bond arrays: u[(k * D + c) * 8 + lane], t likewise.

#include "local_stencil.hpp"
#include "perikit/core/simd.hpp"
#include "perikit/engine/laws.hpp"

namespace perikit {

/// Eight points: H of evaluation points 8 tile ... + 7 at lanes (q - 8 tile) * 8 + point.
template <int D>
void tile_gradient(const LocalStencil& s, int tile, const double* u, double* H) noexcept {
  for (int e = 0; e < D; ++e) {
    const double* g = s.row(e, tile);
    for (int l = 0; l < 8; l += pack_width) {
      Pack sums[8][D];
      for (int k = 0; k < s.bonds; ++k) {
        Pack v[D];
        for (int c = 0; c < D; ++c) v[c] = Pack::load(u + (k * D + c) * 8 + l);
        for (int q = 0; q < 8; ++q)
          for (int c = 0; c < D; ++c) sums[q][c] += Pack(g[k * 8 + q]) * v[c];
      }
      for (int q = 0; q < 8; ++q)
        for (int c = 0; c < D; ++c) sums[q][c].store(H + (c * D + e) * batch_points + q * 8 + l);
    }
  }
}

/// t += sum over the tile of g WP.
template <int D>
void tile_adjoint(const LocalStencil& s, int tile, const double* WP, double* t) noexcept {
  for (int e = 0; e < D; ++e) {
    const double* g = s.row(e, tile);
    for (int l = 0; l < 8; l += pack_width) {
      Pack p[8][D];
      for (int q = 0; q < 8; ++q)
        for (int c = 0; c < D; ++c) p[q][c] = Pack::load(WP + (c * D + e) * batch_points + q * 8 + l);
      for (int k = 0; k < s.bonds; ++k) {
        for (int c = 0; c < D; ++c) {
          Pack sum = Pack::load(t + (k * D + c) * 8 + l);
          for (int q = 0; q < 8; ++q) sum += Pack(g[k * 8 + q]) * p[q][c];
          sum.store(t + (k * D + c) * 8 + l);
        }
      }
    }
  }
}

/// One point, u[k * D + c]: H of evaluation points 8 tile ... + 7 at lanes 0 ... 7.
template <int D>
void single_gradient(const LocalStencil& s, int tile, const double* u, double* H) noexcept {
  for (int e = 0; e < D; ++e) {
    const double* g = s.row(e, tile);
    for (int l = 0; l < 8; l += pack_width) {
      Pack sums[D];
      for (int k = 0; k < s.bonds; ++k) {
        const Pack stencil = Pack::load(g + k * 8 + l);
        for (int c = 0; c < D; ++c) sums[c] += stencil * Pack(u[k * D + c]);
      }
      for (int c = 0; c < D; ++c) sums[c].store(H + (c * D + e) * batch_points + l);
    }
  }
}

/// One point: t[(k * D + c) * 8 + lane] += g WP lane by lane; the lanes are to be summed at the end.
template <int D>
void single_adjoint(const LocalStencil& s, int tile, const double* WP, double* t) noexcept {
  for (int e = 0; e < D; ++e) {
    const double* g = s.row(e, tile);
    for (int l = 0; l < 8; l += pack_width) {
      Pack p[D];
      for (int c = 0; c < D; ++c) p[c] = Pack::load(WP + (c * D + e) * batch_points + l);
      for (int k = 0; k < s.bonds; ++k) {
        const Pack stencil = Pack::load(g + k * 8 + l);
        for (int c = 0; c < D; ++c) {
          double* sum = t + (k * D + c) * 8 + l;
          (Pack::load(sum) + stencil * p[c]).store(sum);
        }
      }
    }
  }
}

}  // namespace perikit
