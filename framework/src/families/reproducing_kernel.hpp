#pragma once
#include <vector>

#include "families/family_arrays.hpp"

namespace perikit {

/// Point gradient that is exact for polynomials of total degree `order` (reproducing kernel) [Partmann et al. 3.43-3.53]:
///   g_k = omega V_k (M^-1 q(xi_k))_linear / delta,  M = sum_k omega V_k q q^T,  q: monomials of xi/delta of degree 1 ... order.
/// g[k * D + e]. Takes the highest order not above `order` that the family supports; returns it, 0 (and g = 0) for none.
int reproducing_kernel(const FamilyArrays& family, double horizon, int order, std::vector<double>& g);

}  // namespace perikit
