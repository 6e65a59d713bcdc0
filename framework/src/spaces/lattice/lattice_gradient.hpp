#pragma once
/// Point gradient (order 1) and its adjoint, the divergence, on a lattice. Neighbours along a row are contiguous: packs of
/// points are processed at once, and offsets +d, -d together, so that the owner's own value cancels in whole families.
///
///   S_i  = sum_s omega_s (u_{i+s} - u_i) (x) d_s          H_i = S_i K_i^-1 / spacing
///   f_k  = sum_s omega_s Q_{k+s} d_s + Q_k m_k            Q_i = W_i P_i K_i^-1 / spacing,  m_k = sum_s omega_s d_s
///
/// Beside them, at little cost, the plain sums over neighbours: sum_s omega_s u_{k+s} with the gradient, f_k += sum_s omega_s v_{k+s} of
/// a source v with the divergence.
///
/// A point has the same bits in runs of any number of chunks: which chunks follow each other differs from rank to rank.
///
/// Sums run along the internal axes of the lattice (d, K, Q, m); H and S have the components of the input axes.
/// (s runs over intact bonds; dead cells hold u = 0 and Q = 0, so that free surfaces need no masks but the first moment m.)

#include "families/lattice/lattice_families.hpp"
#include "families/stencils.hpp"
#include "perikit/core/simd.hpp"

namespace perikit {

template <int D>
class LatticeOperator {
 public:
  explicit LatticeOperator(const LatticeFamilies& families) : f_(families) {}

  /// H of `count` chunks of one block, in their order: H[(a * D + b) * stride + lane], lanes from 0.
  void gradient(const LatticeChunk* chunks, int count, ConstFieldView u, double* H, std::size_t stride) const noexcept {
    runs<false>(chunks, count, u, H, stride, nullptr);
  }
  /// The same, and sums[a * stride + lane] = sum_s omega_s u_{k+s} over intact bonds.
  void gradient_and_sums(const LatticeChunk* chunks, int count, ConstFieldView u, double* H, double* sums, std::size_t stride) const noexcept {
    runs<true>(chunks, count, u, H, stride, sums);
  }

  /// Q = W S K^-1 / spacing for one chunk, in place of any stress S: Q[c] at at + lane. W: by lane; null: S is weighted already.
  void stress_to_flux(const LatticeChunk& chunk, const double* S, std::size_t s_stride, FieldView Q, std::int64_t at, const double* W = nullptr) const noexcept {
    const LatticePattern& pattern = f_.pattern(chunk);
    for (int l = 0; l < chunk_points; l += pack_width) {
      const Pack scale = W ? Pack(1.0 / f_.spacing) * Pack::load(W + l) : Pack(1.0 / f_.spacing);
      Pack inverse[6];
      for (int k = 0; k < symmetric_components(D); ++k) inverse[k] = Pack::load(pattern.inverse[k] + l) * scale;
      for (int c = 0; c < D; ++c) {
        Pack s[D];
        for (int e = 0; e < D; ++e) s[e] = Pack::load(S + static_cast<std::size_t>(c * D + f_.grid.axis[e]) * s_stride + l);
        Pack q[D];
        times_inverse<D>(s, inverse, q);
        for (int e = 0; e < D; ++e) q[e].store(Q.component(c * D + e) + at + l);
      }
    }
  }

  /// f += Q m of one chunk, whose Q is at `at`: what its points feel of their own flux.
  void own_flux(const LatticeChunk& chunk, ConstFieldView Q, std::int64_t at, FieldView f) const noexcept {
    if (chunk.pattern < 0) return;   // moments of whole families vanish
    const LatticePattern& pattern = f_.pattern(chunk);
    for (int c = 0; c < D; ++c)
      for (int l = 0; l < chunk_points; l += pack_width) {
        Pack own(0.0);
        for (int e = 0; e < D; ++e) own += Pack::load(Q.component(c * D + e) + at + l) * Pack::load(pattern.moment[e] + l);
        (Pack::load(f.component(c) + chunk.first + l) + own).store(f.component(c) + chunk.first + l);
      }
  }

  /// f += div Q for the target rows that the sources in `row` reach, where forces are to be complete. Q of the cell row.first is
  /// at `from`; sources are read along the row, as far as a family reaches beyond its ends.
  void divergence(const LatticeRow& row, ConstFieldView Q, std::int64_t from, FieldView f) const noexcept {
    scatter<false>(row, Q, from, {}, f);
  }
  /// The same and f_k += sum_s omega_s v_{k+s}; v is 0 in dead cells. Q and v are fields of the body.
  void divergence(const LatticeRow& row, ConstFieldView Q, ConstFieldView v, FieldView f) const noexcept {
    scatter<true>(row, Q, row.first, v, f);
  }

  /// Takes what the sources in irregular lanes have sent too much along broken and weakened bonds back out of the divergence (v: null if there
  /// was none). Q of the chunk begins at `from`.
  void remove_broken(const LatticeChunk& chunk, ConstFieldView Q, std::int64_t from, ConstFieldView v, FieldView f) const noexcept {
    const LatticePattern& pattern = f_.pattern(chunk);
    for (int l = 0; l < chunk_points; ++l) {
      if (!(pattern.irregular >> l & 1)) continue;
      const std::int64_t p = chunk.first + l;
      for (std::size_t s = 0; s < f_.slots.offsets.size(); ++s) {
        const double gone = 1 - pattern.b(s, l);
        const std::int64_t far = p + f_.slots.shifts[s];
        if (gone == 0 || !(f_.live_bits(far) & 1)) continue;
        for (int c = 0; c < D; ++c) {
          double sent = v.data ? -v.component(c)[p] : 0.0;
          for (int e = 0; e < D; ++e) sent += f_.slots.offsets[s][static_cast<std::size_t>(e)] * Q.component(c * D + e)[from + l];
          f.component(c)[far] += gone * f_.slots.omega[s] * sent;
        }
      }
    }
  }

 private:
  template <bool with_sums>
  void runs(const LatticeChunk* chunks, int count, ConstFieldView u, double* H, std::size_t stride, double* sums) const noexcept {
    for (int c = 0; c < count;) {
      const int lane = c * chunk_points;
      double* near = with_sums ? sums + lane : nullptr;
      const auto adjacent = [&](int n) { return count - c >= n && chunks[c + n - 1].first == chunks[c].first + (n - 1) * chunk_points; };
      if (adjacent(4)) {
        run<4, with_sums>(chunks + c, u, H + lane, stride, near);
        c += 4;
      } else if (adjacent(2)) {
        run<2, with_sums>(chunks + c, u, H + lane, stride, near);
        c += 2;
      } else {
        run<1, with_sums>(chunks + c, u, H + lane, stride, near);
        c += 1;
      }
    }
  }

  template <int chunks_at_once, bool with_sums>
  void run(const LatticeChunk* chunks, ConstFieldView u, double* H, std::size_t stride, double* sums) const noexcept {
    constexpr int V = chunks_at_once * chunk_points / pack_width;
    const std::int64_t p = chunks[0].first;
    const Pack scale(1.0 / f_.spacing);
    for (int c = 0; c < D; ++c) {
      const double* base = u.component(c) + p;
      Pack s[3][V], near[V];
      if (f_.slots.own_row >= 0) {
        const RowProfile& profile = f_.slots.profiles[static_cast<std::size_t>(f_.slots.own_row)];
        for (int k = 1; k <= profile.reach; ++k) {
          const Pack w(profile.omega_d0[static_cast<std::size_t>(k)]);
          const Pack plain(profile.omega[static_cast<std::size_t>(k)]);
          for (int v = 0; v < V; ++v) {
            const Pack ahead = Pack::load(base + v * pack_width + k), behind = Pack::load(base + v * pack_width - k);
            s[0][v] = multiply_add(w, ahead - behind, s[0][v]);
            if constexpr (with_sums) near[v] = multiply_add(plain, ahead + behind, near[v]);
          }
        }
      }
      if constexpr (D > 1) {
        for (const RowPair& row : f_.slots.row_pairs) {
          Pack total[V];
          const RowProfile& profile = f_.slots.profiles[static_cast<std::size_t>(row.profile)];
          const double* w = profile.omega.data();
          const double* wk = profile.omega_d0.data();
          switch (profile.reach) {
            case 0: row_sums<V, 0, with_sums>(base, row.shift, 0, w, wk, s[0], total, near); break;
            case 1: row_sums<V, 1, with_sums>(base, row.shift, 1, w, wk, s[0], total, near); break;
            case 2: row_sums<V, 2, with_sums>(base, row.shift, 2, w, wk, s[0], total, near); break;
            default: row_sums<V, -1, with_sums>(base, row.shift, profile.reach, w, wk, s[0], total, near);
          }
          for (int v = 0; v < V; ++v) {
            s[1][v] = multiply_add(Pack(row.d1), total[v], s[1][v]);
            if constexpr (D > 2) s[2][v] = multiply_add(Pack(row.d2), total[v], s[2][v]);
          }
        }
      }
      for (int v = 0; v < V; ++v) {
        const int lane = v * pack_width % chunk_points;
        const LatticeChunk& chunk = chunks[v * pack_width / chunk_points];
        const LatticePattern& pattern = f_.pattern(chunk);
        if (chunk.pattern >= 0) {
          const Pack own = Pack::load(base + v * pack_width);
          for (int e = 0; e < D; ++e) s[e][v] = multiply_add(-own, Pack::load(pattern.moment[e] + lane), s[e][v]);
          if (pattern.irregular) replace_irregular<V, with_sums>(chunk, pattern, lane, u.component(c), s, near, v);
        }
        if constexpr (with_sums) near[v].store(sums + static_cast<std::size_t>(c) * stride + v * pack_width);
        for (int e = 0; e < D; ++e) {
          Pack h(0.0);
          for (int k = 0; k < D; ++k) h = multiply_add(s[k][v], Pack::load(pattern.inverse[symmetric_index(D, k, e)] + lane), h);
          (h * scale).store(H + static_cast<std::size_t>(c * D + f_.grid.axis[e]) * stride + v * pack_width);
        }
      }
    }
  }

  /// Sums over one mirrored pair of rows: along += sum omega d0 (u+ - u-), total = sum omega (u+ - u-), near += sum omega (u+ + u-).
  template <int V, int fixed_reach, bool with_sums>
  static void row_sums(const double* base, std::int64_t shift, int reach, const double* w, const double* wk, Pack* along, Pack* total, Pack* near) noexcept {
    const double* plus = base + shift;
    const double* minus = base - shift;
    for (int v = 0; v < V; ++v) {
      const Pack above = Pack::load(plus + v * pack_width), below = Pack::load(minus + v * pack_width);
      total[v] = Pack(w[0]) * (above - below);
      if constexpr (with_sums) near[v] = multiply_add(Pack(w[0]), above + below, near[v]);
    }
    const int last = fixed_reach >= 0 ? fixed_reach : reach;
    for (int k = 1; k <= last; ++k) {
      const Pack omega(w[k]), omega_k(wk[k]);
      for (int v = 0; v < V; ++v) {
        const Pack a = Pack::load(plus + v * pack_width + k), b = Pack::load(minus + v * pack_width - k);
        const Pack c = Pack::load(plus + v * pack_width - k), d = Pack::load(minus + v * pack_width + k);
        const Pack ahead = a - b, behind = c - d;
        along[v] = multiply_add(omega_k, ahead - behind, along[v]);
        total[v] = multiply_add(omega, ahead + behind, total[v]);
        if constexpr (with_sums) near[v] = multiply_add(omega, (a + b) + (c + d), near[v]);
      }
    }
  }

  /// Lanes with broken or weakened bonds: the sum over what is left of them.
  template <int V, bool with_sums>
  void replace_irregular(const LatticeChunk& chunk, const LatticePattern& pattern, int lane, const double* u, Pack (&s)[3][V], Pack (&near)[V], int v) const noexcept {
    if ((pattern.irregular >> lane & ((1 << pack_width) - 1)) == 0) return;
    Pack sums[D + 1];
    intact_sums(pattern, chunk.first + lane, lane, u, sums);
    const PackMask irregular = Pack::load(lane_factors[pattern.irregular] + lane) > 0.5;
    if constexpr (with_sums) near[v] = select(irregular, sums[D], near[v]);
    for (int e = 0; e < D; ++e) s[e][v] = select(irregular, sums[e], s[e][v]);
  }

  /// sum_s omega_s (u_{p+s} - u_p) d_s and, last, sum_s omega_s u_{p+s} over intact bonds of the points p ..., from lane l on.
  [[gnu::noinline]] void intact_sums(const LatticePattern& pattern, std::int64_t p, int l, const double* u, Pack (&sums)[D + 1]) const noexcept {
    const Pack own = Pack::load(u + p);
    for (std::size_t k = 0; k < f_.slots.offsets.size(); ++k) {
      const Pack omega = Pack::load(pattern.b_of(k) + l) * Pack(f_.slots.omega[k]), far = Pack::load(u + p + f_.slots.shifts[k]), w = omega * (far - own);
      for (std::size_t e = 0; e < D; ++e) sums[e] = multiply_add(w, Pack(f_.slots.offsets[k][e]), sums[e]);
      sums[D] = multiply_add(omega, far, sums[D]);
    }
  }

  /// From the sources of a row, component by component: few rows are written at a time, and what profiles sum stays in registers.
  template <bool with_source>
  void scatter(const LatticeRow& row, ConstFieldView Q, std::int64_t from, ConstFieldView source, FieldView f) const noexcept {
    constexpr int packs = 4;
    const int cells = row.chunks * chunk_points;
    for (int c = 0; c < D; ++c) {
      const double* q[3] = {};
      for (int e = 0; e < D; ++e) q[e] = Q.component(c * D + e) + from;
      const double* const v = with_source ? source.component(c) + row.first : nullptr;
      double* const target = f.component(c) + row.first;
      int k = 0;
      for (; k + packs * pack_width <= cells; k += packs * pack_width) scatter<packs, with_source>(row, k, q, v, target);
      for (; k < cells; k += pack_width) scatter<1, with_source>(row, k, q, v, target);
    }
  }

  /// A component of the forces of V packs of sources from cell k of the row on.
  template <int V, bool with_source>
  void scatter(const LatticeRow& row, int k, const double* const (&q)[3], const double* source, double* target) const noexcept {
    const auto at = [&](const double* values, int v) { return Pack::load(values + k + v * pack_width); };
    if (f_.slots.own_row >= 0) {
      const RowProfile& profile = f_.slots.profiles[static_cast<std::size_t>(f_.slots.own_row)];
      for (int v = 0; v < V; ++v) {
        Pack a = at(target, v);
        for (int n = 1; n <= profile.reach; ++n) {
          a = multiply_add(Pack(profile.omega_d0[static_cast<std::size_t>(n)]), at(q[0] + n, v) - at(q[0] - n, v), a);
          if constexpr (with_source) a = multiply_add(Pack(profile.omega[static_cast<std::size_t>(n)]), at(source + n, v) + at(source - n, v), a);
        }
        a.store(target + k + v * pack_width);
      }
    }
    if constexpr (D > 1) {
      int current = -1;
      Pack a[V], b[V], g[V];  // even in the offset across the rows, and odd along one and the other axis
      for (const RowPair& pair : f_.slots.row_pairs) {
        const bool below = wanted(row.k1 - pair.d1, row.k2 - pair.d2), above = wanted(row.k1 + pair.d1, row.k2 + pair.d2);
        if (!below && !above) continue;
        if (pair.profile != current) {
          current = pair.profile;
          const RowProfile& profile = f_.slots.profiles[static_cast<std::size_t>(current)];
          const Pack w0(profile.omega[0]);
          for (int v = 0; v < V; ++v) {
            a[v] = with_source ? w0 * at(source, v) : Pack(0.0);
            b[v] = w0 * at(q[1], v);
            if constexpr (D > 2) g[v] = w0 * at(q[2], v);
          }
          for (int n = 1; n <= profile.reach; ++n) {
            const Pack w(profile.omega[static_cast<std::size_t>(n)]), wn(profile.omega_d0[static_cast<std::size_t>(n)]);
            for (int v = 0; v < V; ++v) {
              a[v] = multiply_add(wn, at(q[0] + n, v) - at(q[0] - n, v), a[v]);
              b[v] = multiply_add(w, at(q[1] + n, v) + at(q[1] - n, v), b[v]);
              if constexpr (D > 2) g[v] = multiply_add(w, at(q[2] + n, v) + at(q[2] - n, v), g[v]);
              if constexpr (with_source) a[v] = multiply_add(w, at(source + n, v) + at(source - n, v), a[v]);
            }
          }
        }
        for (int v = 0; v < V; ++v) {
          Pack across = multiply_add(Pack(pair.d1), b[v], Pack(0.0));
          if constexpr (D > 2) across = multiply_add(Pack(pair.d2), g[v], across);
          double* const to = target + k + v * pack_width;
          if (below) (Pack::load(to - pair.shift) + (a[v] + across)).store(to - pair.shift);
          if (above) (Pack::load(to + pair.shift) + (a[v] - across)).store(to + pair.shift);
        }
      }
    }
  }

  /// Whether the row is there, and somebody asks for the forces on it.
  bool wanted(std::int64_t k1, std::int64_t k2) const noexcept {
    const std::int64_t rows = f_.grid.extent[1];
    const auto& complete = f_.tiles.complete_rows;
    return k1 >= 0 && k1 < rows && k2 >= 0 && k2 < f_.grid.extent[2] &&
           (complete.empty() || complete[static_cast<std::size_t>(k1 + k2 * rows)]);
  }

  const LatticeFamilies& f_;
};

}  // namespace perikit
