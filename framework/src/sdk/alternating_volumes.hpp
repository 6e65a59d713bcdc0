#pragma once
/// Volumes of nearly incompressible points that alternate between neighbours.

#include <string>

#include "perikit/problem/problem.hpp"

namespace perikit {

/// Strain energy, over that of the body, in what differs between ln Jbar of a nearly incompressible point and the mean of its
/// nearest neighbours: sum over points of E'' (ln Jbar_i - mean_i)^2/2, E'' = d^2 E_i/d(ln Jbar)^2, where E'' is at least 500
/// shear moduli times the volume. 0 where volumes are not those of points, and where u is inadmissible. All ranks must call it.
///
/// Point gradients hardly see what alternates from point to point, so that some combination of volumes hardly depends on the
/// displacement: one checkerboard in a cube of 5^3 points between held faces. What strains leave in it, no displacement can take
/// away, and the bulk modulus counts all of it. A true field of volumes is smooth and holds about mu/kappa of the energy.
double energy_of_alternating_volumes(Problem& problem, ConstFieldView u);

/// A sentence for the user where that is more than a hundredth, else empty.
std::string warn_of_alternating_volumes(Problem& problem, ConstFieldView u);

}  // namespace perikit
