#pragma once
#include <string>
#include <vector>

#include "families/families.hpp"
#include "perikit/problem/constraints.hpp"
#include "perikit/problem/state.hpp"
#include "scene/scene.hpp"

namespace perikit {

/// What a scene says that is allowed and can hardly be meant, one sentence each: cracks that cut nothing, loads on points that
/// are held, boundaries and initial values that do not fit, an influence function that leaves out the nearest neighbours.
std::vector<std::string> questionable(const Scene& scene, const Families& families, const Constraints& constraints,
                                      bool quasi_static, State& state);

/// Throws InputError where the influence function is positive nowhere.
void refuse_no_influence(const Scene& scene, const InfluenceFunction& influence);

}  // namespace perikit
