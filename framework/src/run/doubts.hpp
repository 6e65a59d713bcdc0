#pragma once
#include <string>
#include <vector>

#include "perikit/problem/body_problem.hpp"
#include "perikit/scene/scene.hpp"

namespace perikit {

/// What makes the results of a sound scene doubtful, one line each: points at random that nothing balances, boxes that are no multiple
/// of the spacing, bodies thinner than a family.
std::vector<std::string> doubts(const Scene& scene, const BodyProblem& problem);

}  // namespace perikit
