#pragma once
/// Which evaluation points of a space are laminates: found by their stencils from the distances of points from interfaces.

#include "operators/laminates.hpp"
#include "spaces/evaluation_space.hpp"

namespace perikit {

/// Looks among the evaluation points of the marked points near interfaces, and forgets what was found of them before. How many see an interface and
/// are no laminates.
template <int D>
std::size_t find_laminates(const SpaceParts& parts, const EvaluationSpace& space, const GroupMarks& marks, Laminates& laminates);

}  // namespace perikit
