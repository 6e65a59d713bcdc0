#pragma once
/// From [material] and [[region]] to the laws of a body.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "perikit/body/body.hpp"
#include "perikit/operators/laws.hpp"
#include "perikit/plugin/part.hpp"
#include "scene/scene.hpp"

namespace perikit {

/// The materials of the scene in the order of Body::material_ids: [material], then those of the regions.
std::vector<std::shared_ptr<const PartValues>> materials(const Scene& scene);

/// Their laws, with constants at the points of `body`; then those that store nothing: of images, and of the far points of a part of a
/// body. Throws InputError.
std::unique_ptr<Laws> build_laws(const Scene& scene, const PartFactory& factory, const Body& body, bool images);

/// A law that stores nothing.
MaterialRecord silent_record();

/// Warnings of materials with history that soften: their stress falls where a stretch grows that keeps the volume, tried to a logarithmic strain of 1. No material has a
/// length of its own over which it would.
std::vector<std::string> softening(const Scene& scene, const Body& body, const Laws& laws);

/// What to say of the first point without a density; nothing where all have one.
std::optional<InputError> missing_density(const Scene& scene, const Body& body, const Laws& laws);

}  // namespace perikit
