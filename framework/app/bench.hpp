#pragma once
#include <string>
#include <vector>

#include "perikit/plugin/registry.hpp"

namespace perikit::app {

/// Prints the limits of this machine, then time per point and explicit step (everything in it, no output) and bytes per point for
/// each kinematics with Saint Venant-Kirchhoff on a lattice and on a jittered cloud of cells^dimension points, horizon 3.015 spacings.
/// kinematics: names, with a stabilization as "conventional+silling"; empty: all known ones.
void bench(Registry& registry, const std::vector<std::string>& kinematics, int dimension, int cells);

}  // namespace perikit::app
