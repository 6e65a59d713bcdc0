#pragma once
/// Point gradients of an order that no family of the body supports.

#include "families/families.hpp"
#include "model/formulation.hpp"
#include "scene/scene.hpp"

namespace perikit {

/// Throws an InputError where not even the largest family supports the order that the scene asks for, so that the key would
/// change nothing. Families at surfaces that support a lower one only are no reason: they take that, and the summary counts them.
/// All ranks must call it.
void refuse_order(const Scene& scene, const Formulation& formulation, const Families& families);

}  // namespace perikit
