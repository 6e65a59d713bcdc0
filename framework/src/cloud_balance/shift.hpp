#pragma once
/// Gradients of points, and of parts of families, with which a constant stress is in equilibrium on a cloud. Points have no weights to choose; the stencil itself
/// moves, as little as possible: minimise sum_i W_i sum_j |d_ij|^2 / (2 omega_ij V_j) under
///
///   sum_j d_ij (x) xi_ij = 0 (affine motion stays exact),     A_k = sum_i W_i g_ik - W_k sum_j g_kj = 0 at closed points, g = g0
///   + d.
///
/// The solution is d_ij = omega V_j z_ij, z_ij = lambda_ij - (gradient of lambda)_i xi_ij: what of a field lambda is not affine
/// in the family. One vector a point determines it, and A_k(lambda) = A_k(0) + (S lambda)_k with the matrix S of the energy sum_i
/// W_i sum_j omega V_j |z_ij|^2 / 2. Gradients of parts q of families are moved likewise, with W_q, omega_q and a lambda of their own;
/// they have weights, too, but fewer of them than there are conditions.

#include "cloud_balance/consistency.hpp"
#include "cloud_balance/points_with_full_neighbourhood.hpp"
#include "families/cloud/cloud_families.hpp"

namespace perikit {

/// lambda by point (images included), and what was achieved.
template <int D>
Field find_shift(const SpaceParts& parts, const ClosedPoints& closed, const CloudConsistency& beyond, Balanced& result);

/// The same of the parts of families.
template <int D>
Field find_part_shift(const SpaceParts& parts, const ClosedPoints& closed, const CloudConsistency& beyond, Balanced& result);

/// g of the bonds of a loaded family, without -> with lambda: g[k * dimension + e].
void shift_gradient(const FamilyArrays& family, ConstFieldView lambda, std::vector<double>& g);

}  // namespace perikit
