#pragma once
#include <cstdint>

#include "scene/scene.hpp"

namespace perikit {

/// All throw InputError, before anything of the body's size is allocated.
/// cells: of the lattice, or points of the cloud. More than indices can tell apart are refused.
void check_index(const Scene& scene, double cells);
/// Refuses families of more than 1e7 points, also where the body has fewer. ratio: horizon over spacing.
void check_horizon(const Scene& scene, double ratio);
/// Refuses what the memory of this machine cannot hold, whatever the kinematics. part: these are the cells of one of several
/// ranks.
void check_memory(const Scene& scene, double cells, double ratio, bool cloud, bool part = false);
/// Whether this machine can hold the set-up of kinematics with one gradient a point; others take up to three times that.
bool likely_held(int dimension, double cells, double ratio, bool cloud);
/// Whether a rank without others can put so many points of a cloud in order, all of them at once.
bool lone_rank_orders(double points);

}  // namespace perikit
