#pragma once
/// From a scene to the points of a cloud: jittered or sparse lattices, cells that a surface cuts, point files.

#include <cstdint>
#include <span>

#include "body/partition/streamed_cloud.hpp"
#include "body/points/point_file.hpp"
#include "perikit/body/lattice.hpp"
#include "scene/scene.hpp"

namespace perikit {

struct CloudPoints {
  PointCloud points;   ///< in the order of the input
  double spacing = 0;  ///< of the lattice, or the mean one [m]
};

/// A cloud that nobody has as a whole: its points piece by piece, and where they lie.
struct CloudOutline {
  PointStream points;
  CloudExtent extent;
  double spacing = 0;
};
/// By one pass over the points; volumes are not those of Voronoi cells. The scene must outlive it. Throws InputError as
/// build_body of what a rank of the communicator cannot hold.
CloudOutline cloud_outline(const Scene& scene);

/// Which points a rank is to have: all of them, or a run, those of one rank after those of the other. For runs all ranks must
/// call what takes it.
enum class WhichPoints { all, run };

/// Whether the body of the scene is a cloud, however few cells `inside` keeps.
bool is_cloud(const Scene& scene);

/// Throws InputError as build_body.
CloudPoints cloud_points(const Scene& scene, WhichPoints which);
/// All points of a lattice that is almost empty: in these of its cells, ascending.
CloudPoints points_in_cells(const Scene& scene, const Lattice& lattice, std::span<const std::int32_t> cells);

}  // namespace perikit
