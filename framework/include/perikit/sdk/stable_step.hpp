#pragma once
/// Stable steps of explicit schemes.

#include "perikit/problem/problem.hpp"

namespace perikit {

/// Largest eigenvalue of M^-1 K at u [1/s^2], the square of the highest frequency of the free components: Lanczos iteration on the
/// exact tangent, plus its residual bound. Later calls start from the last eigenvector, which is kept in the state.
/// Central differences are stable up to steps of 2 over its root.
double largest_eigenvalue(Problem& problem, ConstFieldView u);

/// The bond-based estimate P 3.58 of the stable step [s], for comparison: the least over all points of
///   dt = sqrt(2 rho / sum_j V_j C/|xi|)   for a whole family on a lattice of the mean spacing, C the micromodulus.
double bond_based_time_step(const Body& body, const Laws& laws);

}  // namespace perikit
