#pragma once
/// Tractions as forces on points.

#include <memory>

#include "perikit/body/influence.hpp"
#include "perikit/body/body.hpp"
#include "perikit/model/formulation.hpp"

namespace perikit {

/// The area [m^2] that each point has of faces across `axis` in the eyes of the kinematics: its force along the axis where a stress of
/// 1 along the axis is the same everywhere, positive at the upper face and negative at the lower one. Loads in proportion to it hold a
/// homogeneous stress in equilibrium, point by point.
Field face_areas(const Body& body, const Formulation& formulation, std::shared_ptr<const InfluenceFunction> influence, int axis);

}  // namespace perikit
