#pragma once
/// From a scene to the points of a cloud: jittered or sparse lattices, cells that a surface cuts, point files.

#include "perikit/body/point_file.hpp"
#include "perikit/scene/scene.hpp"

namespace perikit {

struct CloudPoints {
  PointCloud points;   ///< in the order of the input
  double spacing = 0;  ///< of the lattice, or the mean one [m]
};

/// Which points a rank is to have: all of them, or a run, those of one rank after those of the other. For runs all ranks must
/// call what takes it.
enum class WhichPoints { all, run };

/// Whether the body of the scene is a cloud, however few cells `inside` keeps.
bool is_cloud(const Scene& scene);

/// Throws InputError as build_body.
CloudPoints cloud_points(const Scene& scene, WhichPoints which);

}  // namespace perikit
