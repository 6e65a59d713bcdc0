#pragma once
/// From [family] interfaces to where evaluation points are laminates.

#include "body/interfaces.hpp"
#include "perikit/model/formulation.hpp"
#include "perikit/plugin/part.hpp"
#include "perikit/scene/scene.hpp"

namespace perikit {

/// Where the materials of a scene meet, on its whole body without images. Throws InputError for laminates where there is nothing that
/// could be one.
Interfaces build_interfaces(const Scene& scene, const PartFactory& factory, const Formulation& formulation, const Body& body);

}  // namespace perikit
