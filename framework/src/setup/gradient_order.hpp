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

/// Whether the second moments of cells count, as the kinematics wants it or, where it leaves that open, on lattices over orders above 1. Throws an InputError
/// where they are asked for and there are none.
void set_cell_moments(const Scene& scene, const Body& body, Formulation& formulation);

}  // namespace perikit
