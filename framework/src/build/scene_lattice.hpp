#pragma once
#include "perikit/body/body.hpp"
#include "perikit/scene/scene.hpp"

namespace perikit {

/// Refuses keys about volumes that would change nothing. Throws InputError.
void check_volumes(const Scene& scene);
/// The horizon of a scene for points so far apart [m].
double scene_horizon(const Scene& scene, double spacing);
/// What the scene says of its body beside the points.
BodyFrame scene_frame(const Scene& scene, double spacing);
/// The lattice of a scene that has one, before `inside`. Throws InputError where there is no room for a point, and for families
/// that are too large.
Lattice scene_lattice(const Scene& scene);

/// About so many cells the lattice of a scene has, before anything of their number is made.
double estimated_cells(const Scene& scene);
[[noreturn]] void refuse_empty_lattice(const LatticeDescription& description);
/// Whether points fill so little of the box of a lattice that dead cells would dominate.
bool sparse(double points, const Lattice& lattice);

}  // namespace perikit
