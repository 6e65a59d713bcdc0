#pragma once
/// Bodies that are one point thick.

#include "families/families.hpp"
#include "problem/ghosts.hpp"
#include "scene/scene.hpp"

namespace perikit {

/// Throws InputError where the body, or a piece of it that no bond joins to the rest, has several points and no family that spans all
/// dimensions: no point has a gradient across such a layer, and what the layer stores depends on the kinematics, not on the material. Chips, with a hundredth
/// of the volume of the body or less, are warned of. Pre-cracks separate nothing here, and single points without bonds, such as fracture leaves, are
/// allowed. ghosts: null on one rank. All ranks must call it.
void refuse_thin_pieces(const Scene& scene, const Families& families, Ghosts* ghosts, std::vector<std::string>& warnings);

}  // namespace perikit
