#pragma once
/// A body of the engine as the dense reference sees it, points in input order.

#include <optional>

#include "perikit/body/body.hpp"
#include "perikit/body/influence.hpp"
#include "scene/scene.hpp"
#include "framework/reference/reference.hpp"

namespace perikit::contract {

/// `body` and `influence` must outlive the result.
reference::Cloud cloud_of(const Body& body, const InfluenceFunction& influence);
/// Of the fixture's material at modulus 1, as the space of the body sees it.
reference::Elasticity elasticity(const Body& body);
reference::Vector dense(const Body& body, ConstFieldView field);
/// The reference's description of a kinematics; nothing where the reference does not know the part.
std::optional<reference::Description> description_of(const PartValues& part);
/// Of `conventional` on this body: the cells whose second moments count.
void set_cell(const PartValues& part, const Body& body, reference::Description& description);
/// The fixture's material: S = lambda tr(E) I + 2 mu E.
reference::Law saint_venant_kirchhoff();

}  // namespace perikit::contract
