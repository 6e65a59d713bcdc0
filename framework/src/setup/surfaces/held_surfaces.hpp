#pragma once
/// [[boundary]] with surface: what points have images behind, and where the points of a cloud may lie.

#include <string>
#include <vector>

#include "setup/surfaces/image_planes.hpp"

namespace perikit {

/// Moves points of a cloud that was made from a lattice, which nobody placed by hand, away from held surfaces: to a quarter of a
/// spacing in front of them, where they lie nearer or behind.
void keep_off_surfaces(const Scene& scene, double spacing, std::vector<Point>& positions);

/// The surfaces of a scene; their motions are appended to those of the planes. Throws InputError for lattices, surfaces that no
/// points touch, points behind a surface, bodies that are too thin or bent for mirror images, cracks that come near, and surfaces
/// held twice. All ranks must call it.
void add_surfaces(const Scene& scene, const PlacedPoints& points, bool quasi_static, ScenePlanes& planes);

}  // namespace perikit
