#pragma once
#include <cstdint>

#include "perikit/scene/scene.hpp"

namespace perikit {

/// All throw InputError, before anything of the body's size is allocated.
/// cells: of the lattice, or points of the cloud. More than indices can tell apart are refused.
void check_index(const Scene& scene, double cells);
/// Refuses families of more than 1e7 points, also where the body has fewer. ratio: horizon over spacing.
void check_horizon(const Scene& scene, double ratio);
/// Refuses what the memory of this machine cannot hold, whatever the kinematics. part: these are the cells of one of several
/// ranks.
void check_memory(const Scene& scene, double cells, double ratio, bool cloud, bool part = false);
/// Refuses clouds all of whose points a rank without others cannot have at once.
void check_lone(const Scene& scene, double points);

}  // namespace perikit
