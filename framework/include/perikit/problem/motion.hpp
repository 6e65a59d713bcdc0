#pragma once
/// What follows from the state of a problem, its masses, loads and constraints.

#include <vector>

#include "perikit/problem/problem.hpp"

namespace perikit {

/// Of a velocity field [J].
double kinetic_energy(const Problem& problem, ConstFieldView velocity);
/// (internal + external)/mass at time t, prescribed components as prescribed [m/s^2].
Field accelerations(Problem& problem, double t);
/// Force that the constraints exert, 0 at free components: mass a - internal - external [N]; a only for dynamic runs. memory: of
/// an earlier call, to be used again.
Field reactions(Problem& problem, bool dynamic, double t, Field memory = {});
/// What holds a side of the body acts beyond the points that `reactions` gives it to. Its moment about where these points are [N m]: about z in
/// 2D, about x, y and z in 3D. memory: of an earlier call, to be used again. All ranks must call it.
Field reaction_couples(Problem& problem, Field memory = {});
/// The motions of all points at u as one rigid body, d (d + 1)/2 fields of about the same size: translations, then rotations about its
/// middle.
std::vector<Field> rigid_motions(const Points& points, ConstFieldView u);

}  // namespace perikit
