#pragma once
/// From a scene to its body.

#include "perikit/body/body.hpp"
#include "scene/scene.hpp"

namespace perikit {

/// The points that the scene describes, with its sets, materials (0: [material], 1 ...: [[region]] in order) and pre-cracks.
/// Throws InputError for an empty body, an empty set, a horizon smaller than the spacing of all points, too many points.
Body build_body(const Scene& scene);

/// Whether one rank can have the body of the scene as a whole, as far as its size is known before it is read.
bool one_rank_holds(const Scene& scene);
/// The one of so many ranks that has most cells of the scene's lattice, with those within two horizons of its own. Ranks have
/// about as many points of a cloud each: one in the middle of the curve.
int heaviest_rank(const Scene& scene, int ranks);

}  // namespace perikit
