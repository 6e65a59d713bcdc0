// The stencils of a point, of one of its bonds and of an evaluation point with weights, from bonds that lie in memory as `count` numbers a component.
#include "families/stencils.hpp"

using namespace perikit;

template <int D, class T>
void read(const T* from, int count, int k, T (&to)[D]) noexcept {
  for (int e = 0; e < D; ++e) to[e] = from[e * count + k];
}

/// K, H = sum u (x) g, and the forces of the stress P on the bonds.
template <int D, class T>
void of_point(int count, const T* xi, const T* u, const T* omega, const T* volume, const T* inverse, const T* P, T* K, T* H, T* force) noexcept {
  for (int k = 0; k < count; ++k) {
    T bond[D], g[D];
    read<D>(xi, count, k, bond);
    add_to_shape_tensor<D>(omega[k] * volume[k], bond, K);
    point_stencil<D>(omega[k], volume[k], inverse, bond, g);
    for (int c = 0; c < D; ++c) {
      T row[D], Q[D];
      read<D>(P, 1, c * D, row);
      times_inverse<D>(row, inverse, Q);
      for (int e = 0; e < D; ++e) {
        H[c * D + e] += u[c * count + k] * g[e];
        force[c * count + k] += omega[k] * volume[k] * Q[e] * bond[e];
      }
    }
  }
}

/// H_b of one bond from A, and what the stress WP, row by row, does to A and to the bond.
template <int D, class T>
void of_bond(const T* A, const T* du, const T* bond, const T* correction, const T* WP, T* H, T* stress, T* force) noexcept {
  T xi[D], g[D];
  read<D>(bond, 1, 0, xi);
  read<D>(correction, 1, 0, g);
  for (int c = 0; c < D; ++c) {
    T gradient[D], row[D], P[D];
    read<D>(A, 1, c * D, gradient);
    read<D>(WP, 1, c * D, P);
    bond_shape_row<D>(gradient, du[c], xi, g, row);
    force[c] = bond_shape_row_adjoint<D>(P, xi, g);
    for (int e = 0; e < D; ++e) {
      H[c * D + e] = row[e];
      stress[c * D + e] = P[e];
    }
  }
}

/// g of the bonds in an evaluation point, and what its gradient H leaves of them.
template <int D, class T>
void of_part(int count, const T* xi, const T* lever, const T* u, const T* omega, const T* of_inverse, const T* H, T* g, T* z) noexcept {
  T inverse[symmetric_components(D)];
  for (int c = 0; c < symmetric_components(D); ++c) inverse[c] = of_inverse[c];
  for (int k = 0; k < count; ++k) {
    T bond[D], b[D], of_bond[D];
    read<D>(xi, count, k, bond);
    read<D>(lever, count, k, b);
    weighted_stencil<D>(omega[k], inverse, b, of_bond);
    for (int c = 0; c < D; ++c) {
      g[c * count + k] = of_bond[c];
      z[c * count + k] = bond_residual<D>(u[c * count + k], H + c * D, bond);
    }
  }
}

#define STENCILS(D, T)                                                                                                                             \
  template void of_point<D, T>(int, const T*, const T*, const T*, const T*, const T*, const T*, T*, T*, T*) noexcept;                              \
  template void of_bond<D, T>(const T*, const T*, const T*, const T*, const T*, T*, T*, T*) noexcept;                                              \
  template void of_part<D, T>(int, const T*, const T*, const T*, const T*, const T*, const T*, T*, T*) noexcept;
STENCILS(1, double)
STENCILS(2, double)
STENCILS(3, double)
STENCILS(1, float)
STENCILS(2, float)
STENCILS(3, float)
