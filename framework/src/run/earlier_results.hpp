#pragma once
#include <string>

#include "problem/body_problem.hpp"
#include "scene/scene.hpp"

namespace perikit {

/// With [initial] from: takes the bonds that had failed in the earlier run, and the history of its laws, from its checkpoint.
/// Throws InputError where they would be lost. Returns what was taken, in words; empty: nothing.
std::string carry_from_earlier_run(const Scene& scene, BodyProblem& problem);

}  // namespace perikit
