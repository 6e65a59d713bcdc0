#pragma once
/// From [damage] to the limits of bonds.

#include <memory>
#include <string>
#include <vector>

#include "body/partition/partition.hpp"
#include "fracture/body_damage.hpp"
#include "perikit/plugin/part.hpp"
#include "perikit/problem/image_map.hpp"
#include "scene/scene.hpp"
#include "terms/terms.hpp"

namespace perikit {

/// The criterion of the scene with its limits by point, for these parts of the terms; null without [damage]. images (null: none)
/// have the limits of their sources, ghosts of a partition (null: one rank) those of their owners. Throws InputError where the
/// criterion does not suit the kinematics or the integrator; adds to `warnings` what is allowed and can hardly be meant. made: the images as they were made.
std::unique_ptr<const BodyDamage> build_damage(const Scene& scene, const PartFactory& factory, const TermParts& parts,
                                               const ImageMap* images, const Images& made, const Partition* partition, bool quasi_static,
                                               std::vector<std::string>& warnings);

}  // namespace perikit
