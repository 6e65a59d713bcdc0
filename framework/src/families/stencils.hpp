#pragma once
/// The formulas of stencils, each once, for any scalar: double, float, a pack of lanes. They are arithmetic on numbers that are handed over, with no memory, no
/// function pointers and no exceptions, so that they compile alone for other machines, too (tests/devices). What reads and writes around them is left to
/// families, spaces and assemblies. K^-1 is stored as shape_tensor.hpp has it.

#include "families/shape_tensor.hpp"
#include "perikit/core/tensor.hpp"

namespace perikit {

/// K += w xi (x) xi, w = omega V.
template <int D, class T, class Bond>
void add_to_shape_tensor(T w, const Bond& xi, T* K) noexcept {
  for (int a = 0; a < D; ++a)
    for (int e = a; e < D; ++e) K[symmetric_index(D, a, e)] += w * xi[a] * xi[e];
}

/// A bond's vector in the point gradient of order 1: g = omega V K^-1 xi.
template <int D, class T>
void point_stencil(T omega, T volume, const T* inverse, const T (&xi)[D], T (&g)[D]) noexcept {
  for (int e = 0; e < D; ++e) {
    T sum = 0;
    for (int a = 0; a < D; ++a) sum += omega * volume * inverse[symmetric_index(D, a, e)] * xi[a];
    g[e] = sum;
  }
}

/// The same in evaluation point q of a weighted kinematics, with its influence, its K_q^-1 and b = V xi.
template <int D, class T>
void weighted_stencil(T omega, const T (&inverse)[symmetric_components(D)], const T (&b)[D], T (&g)[D]) noexcept {
  for (int e = 0; e < D; ++e) {
    T sum = 0;
    for (int a = 0; a < D; ++a) sum += inverse[symmetric_index(D, a, e)] * b[a];
    g[e] = omega * sum;
  }
}

/// Row c of Q = P K^-1, the adjoint of sums over bonds: the force of a bond is omega V Q xi.
template <int D, class T>
void times_inverse(const T (&P)[D], const T* inverse, T (&Q)[D]) noexcept {
  for (int e = 0; e < D; ++e) {
    T q(0.0);
    for (int k = 0; k < D; ++k) q += P[k] * inverse[symmetric_index(D, k, e)];
    Q[e] = q;
  }
}

/// Component c of what a gradient leaves of a bond: z_c = du_c - H_ck xi_k. H: row c.
template <int D, class T>
T bond_residual(T du, const T* H, const T (&xi)[D]) noexcept {
  PERIKIT_UNROLL for (int e = 0; e < D; ++e) du -= H[e] * xi[e];
  return du;
}

/// Row c of the gradient of a bond shape, H_ce = A_ce + z_c g_e.
template <int D, class T>
void bond_shape_row(const T (&A)[D], T du, const T (&xi)[D], const T (&g)[D], T (&H)[D]) noexcept {
  du = bond_residual<D>(du, A, xi);
  PERIKIT_UNROLL for (int e = 0; e < D; ++e) H[e] = A[e] + du * g[e];
}

/// Its adjoint: t_c = WP_ce g_e acts on du_c, S_ce = WP_ce - t_c xi_e on A_ce. P: row c of WP, and S in its place.
template <int D, class T>
T bond_shape_row_adjoint(T (&P)[D], const T (&xi)[D], const T (&g)[D]) noexcept {
  T t = P[0] * g[0];
  PERIKIT_UNROLL for (int e = 1; e < D; ++e) t += P[e] * g[e];
  PERIKIT_UNROLL for (int e = 0; e < D; ++e) P[e] = P[e] - t * xi[e];
  return t;
}

}  // namespace perikit
