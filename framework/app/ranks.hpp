#pragma once
/// What the command line does about several ranks.

#include <string>

#include "plugin/registry.hpp"
#include "run/simulation.hpp"
#include "scene/scene.hpp"

namespace perikit::app {

/// Cores that a rank has: those that it is bound to, or its share of the machine's.
int cores_of_rank();

/// A warning where a rank has more threads than cores; else empty.
std::string crowded(int threads);

/// Takes one step of an explicit run and computes the fields of a frame, so that all is there that a run has in memory. Nothing
/// is said or written; the state is of no use afterwards.
void try_step(Simulation& simulation);

/// What each of so many ranks would hold and exchange, found by setting up one after the other, in lines. Throws InputError for
/// what they would refuse. heaviest_alone: of the one that has most, where the whole body is too much for one process.
std::string predict_ranks(const Scene& scene, const Registry& registry, int ranks, bool heaviest_alone);

}  // namespace perikit::app
