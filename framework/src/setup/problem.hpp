#pragma once
/// From a scene to the problem that an integrator runs.

#include <memory>

#include "core/threads/work_steps.hpp"
#include "perikit/plugin/part.hpp"
#include "perikit/problem/integrator.hpp"
#include "problem/body_problem.hpp"
#include "scene/scene.hpp"

namespace perikit {

/// Builds everything that the scene describes, by parts from `factory`, for an integrator with these traits. Where the communicator
/// has several ranks: this rank's part of it. steps: where it is told what takes time. further: what acts beside what the scene
/// names. Throws InputError for what only building can show.
std::unique_ptr<BodyProblem> build_problem(const Scene& scene, const PartFactory& factory, const IntegratorTraits& integrator,
                                           WorkSteps& steps, std::vector<TermMaker> further = {});

}  // namespace perikit
