#pragma once
/// From [damage] to what a model and a problem are told of bonds that fail.

#include <memory>

#include "perikit/families/fracture.hpp"
#include "perikit/plugin/part.hpp"
#include "perikit/scene/scene.hpp"
#include "perikit/terms/model.hpp"

namespace perikit {

/// The criterion of the scene; null without [damage]. Throws InputError where it does not suit the integrator.
std::shared_ptr<const Damage> build_criterion(const Scene& scene, const PartFactory& factory, bool quasi_static);

/// The criterion with its limits by point, on a body with these `parts` of a model. ranks: several share the body. Throws
/// InputError where the criterion does not suit them.
std::unique_ptr<const BodyDamage> build_damage(const Scene& scene, std::shared_ptr<const Damage> criterion,
                                               const ModelParts& parts, bool ranks);

}  // namespace perikit
