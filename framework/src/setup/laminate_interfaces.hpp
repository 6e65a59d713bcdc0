#pragma once
/// From [family] interfaces to where evaluation points are laminates.

#include <span>
#include <vector>

#include "body/interfaces.hpp"
#include "model/formulation.hpp"
#include "perikit/plugin/part.hpp"
#include "scene/scene.hpp"

namespace perikit {

/// The materials of a body, by input number.
std::vector<std::uint16_t> materials_of_points(const Body& body);

/// Where the materials of a scene meet, on its whole body or a rank's part of it. material: of the points without images, by input number; sources:
/// of what the images are images of. All ranks that have a part must call it. Throws InputError for laminates where there is nothing that could be
/// one.
Interfaces build_interfaces(const Scene& scene, const PartFactory& factory, const Formulation& formulation, const Body& body,
                            std::vector<std::uint16_t> material, std::span<const std::int32_t> sources);

}  // namespace perikit
