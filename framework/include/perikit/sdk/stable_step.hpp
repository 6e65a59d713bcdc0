#pragma once
/// Stable steps of explicit schemes.

#include "perikit/plugin/parameters.hpp"
#include "perikit/problem/integrator.hpp"
#include "perikit/problem/problem.hpp"
#include "perikit/sdk/eigenvalue.hpp"

namespace perikit {

/// Largest eigenvalue of M^-1 K at u [1/s^2], the square of the highest frequency of the free components: Lanczos iteration on the
/// exact tangent, plus its residual bound. Later calls start from the last eigenvector, which is kept in the state.
/// Central differences are stable up to steps of 2 over its root.
double largest_eigenvalue(Problem& problem, ConstFieldView u);
/// Likewise. Later calls end early where the bound is found to lie below `enough`.
EigenvalueBounds eigenvalue_bounds(Problem& problem, ConstFieldView u, double enough, const GoesOn& goes_on = {});

/// That of a part of the body alone: not above that of the body. Where it is found to lie below `enough`, any bound below that. Nothing is kept.
double largest_eigenvalue(Problem& problem, DamagedPart& part, ConstFieldView u, double enough);

/// Adds the key allow_unstable to the table of an explicit integrator that has a key time_step.
void allow_unstable_parameter(ParameterTable& table);
/// Where the scene gives time_step: InputError if it is longer than the longest stable step at the present state and
/// allow_unstable is false; if it is true, a warning for the observer, if there is one.
void check_time_step(Problem& problem, const ParameterValues& values, Observer* observer = nullptr);

/// The bond-based estimate P 3.58 of the stable step [s], for comparison: the least over all points of
///   dt = sqrt(2 rho / sum_j V_j C/|xi|)   for a whole family on a lattice of the mean spacing, C the micromodulus.
double bond_based_time_step(const Body& body, const Laws& laws);

}  // namespace perikit
