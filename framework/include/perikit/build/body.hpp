#pragma once
/// From a scene to its body.

#include "perikit/body/body.hpp"
#include "perikit/scene/scene.hpp"

namespace perikit {

/// The points that the scene describes, with its sets, materials (0: [material], 1 ...: [[region]] in order) and pre-cracks.
/// Throws InputError for an empty body, an empty set, a horizon smaller than the spacing of all points, too many points.
Body build_body(const Scene& scene);

}  // namespace perikit
