#pragma once
/// What a scene may not ask for on several ranks.

#include <string>

#include "perikit/problem/integrator.hpp"
#include "scene/scene.hpp"

namespace perikit {

/// Throws InputError, naming the key, for what needs the whole body on one rank. Nothing is refused where there is one.
void refuse_on_ranks(const Scene& scene, const IntegratorTraits& integrator);

/// Whether anything may lie beyond planes or surfaces of the body.
bool has_images(const Scene& scene);
/// Whether sets that hold all points on a side of the body hold the side: of points from a file, which may lie on sides.
bool sets_may_hold_sides(const Scene& scene);

}  // namespace perikit
