#pragma once
#include <array>
#include <span>
#include <vector>

#include "families/family_arrays.hpp"

namespace perikit {

/// Number of monomials of degree 1 ... order: as many bonds, at least, must a family have.
constexpr int monomials(int dimension, int order) {
  int count = 1;
  for (int c = 1; c <= dimension; ++c) count = count * (order + c) / c;
  return count - 1;
}
/// Of the highest order that a point gradient can have, in space.
inline constexpr std::size_t most_monomials = monomials(3, 8);

/// Point gradient that is exact for polynomials of total degree `order` (reproducing kernel) [Partmann et al. 3.43-3.53]:
///   g_k = omega V_k (M^-1 q(xi_k))_linear / delta,  M = sum_k omega V_k q q^T,  q: monomials of xi/delta of degree 1 ... order.
/// g[k * D + e]. Takes the highest order not above `order` that the family supports; returns it, 0 (and g = 0) for none.
int reproducing_kernel(const FamilyArrays& family, double horizon, int order, std::vector<double>& g);
/// The gradient of the same fit at places X_i + x: g[(q * bonds + k) * D + e] for the place q. order: one that reproducing_kernel has returned.
void kernel_gradients_at(const FamilyArrays& family, double horizon, int order, std::span<const std::array<double, 3>> places, std::vector<double>& g);
/// What the polynomial of this order that fits values u of the bonds best, by weights omega V, leaves of them: z[k * components + c], as u has
/// them. order: one that reproducing_kernel has returned for the family.
void kernel_residuals(const FamilyArrays& family, double horizon, int order, std::span<const double> u, std::vector<double>& z);

/// Orthonormal polynomials of degree 1 ... order over the bonds of a family, sum_k omega V_k phi_a phi_b = 1 where a = b, else 0:
/// phi[k * m + a], 0 where a bond has no weight. The polynomial that fits values u of the bonds best is sum_a phi_a sum_k omega V_k phi_a(k) u_k.
/// order: one that reproducing_kernel has returned for the family. Returns m, their number.
std::size_t orthonormal_polynomials(const FamilyArrays& family, double horizon, int order, std::vector<double>& phi);

}  // namespace perikit
