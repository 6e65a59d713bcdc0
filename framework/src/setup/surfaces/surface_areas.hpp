#pragma once
/// The free surface of a set as area vectors of points: what pressures act on.

#include <array>
#include <optional>
#include <vector>

#include "perikit/problem/image_map.hpp"
#include "perikit/problem/surface_rule.hpp"
#include "scene/scene.hpp"
#include "terms/terms.hpp"

namespace perikit {

/// Outward area vectors [m^2] by internal index of points, images among them.
struct SurfaceAreas {
  std::vector<std::int32_t> points;
  std::vector<Point> area;
  std::array<std::optional<SurfaceSamples>, 3> samples;  ///< of the faces across each axis, or of the whole surface, where they are known
};

/// What of the free surface each point has that lies nearest to a surface point of the load's set, or (face) of that side of the
/// set. Area vectors are A_i = sum over q of W_q g_qi, the stencils' own, and those of pair laws what their bonds feel in a uniform expansion (pair_areas),
/// so that a body under the same pressure all around is in equilibrium point by point; their sum over a closed surface is zero. On a part of the surface of a
/// lattice the total and the first moments are those of the free cell faces of the set. Of a part of a body it finds the areas of
/// the points whose forces are complete, with all ranks, which must all call it. Throws InputError where the set has no free
/// surface.
SurfaceAreas surface_areas(const LoadDescription& load, const TermParts& parts, const ImageMap* images);

}  // namespace perikit
