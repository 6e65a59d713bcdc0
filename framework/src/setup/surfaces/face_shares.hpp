#pragma once
/// Tractions as forces on points.

#include <cstdint>
#include <vector>

#include "perikit/problem/image_map.hpp"
#include "perikit/problem/surface_rule.hpp"
#include "scene/scene.hpp"
#include "terms/terms.hpp"

namespace perikit {

/// What points carry of a face.
struct FaceShares {
  std::vector<std::int32_t> points;  ///< internal indices
  std::vector<double> share;         ///< areas [m^2]
  SurfaceSamples samples;            ///< of the face
};

/// The area [m^2] of the face of `load` that each point of its set, or below it, carries: exact in total, by point of the body of parts.families.
/// Images (null: none) of these points beside the face carry their part of it. Of a part of a body it finds what points
/// carry whose forces are complete, with all ranks, which must all call it. Throws InputError where no point of the set lies on the face.
FaceShares face_shares(const LoadDescription& load, const TermParts& parts, const ImageMap* images);

/// A stress of 1 along the normal of a face, or along all axes: a pressure. Selective kinematics have areas of their own for the mean stress, whose
/// gradients are those of points; for all others both are the same.
enum class UnitStress { along_axis, all_around };

/// The area [m^2] that each point has of faces across `axis` in the eyes of the kinematics: its force along the axis where a
/// unit stress is the same everywhere, positive at the upper face and negative at the lower one. Loads in
/// proportion to it hold a homogeneous stress in equilibrium, point by point.
Field face_areas(TermParts parts, int axis, UnitStress unit);

}  // namespace perikit
