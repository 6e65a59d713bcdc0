#pragma once
#include <string>
#include <vector>

#include "problem/body_problem.hpp"
#include "scene/scene.hpp"

namespace perikit {

/// What makes the results of a sound scene doubtful, one line each: points at random that nothing balances, boxes that are no multiple
/// of the spacing, bodies thinner than a family, and what find_doubts_of_model finds. All ranks must call it.
std::vector<std::string> doubts(const Scene& scene, BodyProblem& problem);
/// Those of the model among them: nothing that acts, laws that lock, sets that rounding decides.
void find_doubts_of_model(const Scene& scene, const BodyProblem& problem, std::vector<std::string>& lines);
/// By how much trial deformations of the body store another energy than its material: pair laws, thin bodies.
void find_doubts_of_stiffness(const Scene& scene, BodyProblem& problem, std::vector<std::string>& lines);

}  // namespace perikit
