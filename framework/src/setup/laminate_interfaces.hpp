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

/// Where the materials of a scene meet, on its whole body. material: of the points without images, whose sources are `sources`.
/// Throws InputError for laminates where there is nothing that could be one.
Interfaces build_interfaces(const Scene& scene, const PartFactory& factory, const Formulation& formulation, const Body& body,
                            std::vector<std::uint16_t> material, std::span<const std::int32_t> sources);

/// The same on a rank's part of a body that no rank has as a whole, by its input numbers; material: of its points, and of images
/// whatever. All ranks must call it.
Interfaces build_local_interfaces(const Scene& scene, const PartFactory& factory, const Formulation& formulation,
                                  const Body& part, std::vector<std::uint16_t> material, std::span<const std::int32_t> sources);

}  // namespace perikit
