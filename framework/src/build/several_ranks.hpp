#pragma once
/// What a scene may not ask for on several ranks.

#include <string>

#include "perikit/problem/integrator.hpp"
#include "perikit/scene/scene.hpp"

namespace perikit {

/// Throws InputError, naming the key, for what needs the whole body on one rank. Nothing is refused where there is one.
void refuse_on_ranks(const Scene& scene, const IntegratorTraits& integrator);

/// Whether anything lies beyond planes or surfaces of the body.
bool has_images(const Scene& scene);

}  // namespace perikit
