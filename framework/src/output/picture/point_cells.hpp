#pragma once
/// The piece of the body around each point, as a picture shows it: a square or cube that deforms with its neighbours.

#include <Eigen/Core>
#include <span>
#include <vector>

namespace perikit {

struct PointCell {
  Eigen::Vector3d centre;     ///< drawn position
  Eigen::Matrix3d half_edge;  ///< columns: half edges of the deformed cell
  bool dot = false;           ///< of a point on its own: a disc, a little smaller than its cell
  Eigen::Vector3d normal;     ///< outwards, length 1, at the surface of the body; 0 inside
};

struct PointCells {
  std::vector<PointCell> cells;
  double spacing = 0;   ///< typical distance of neighbours
  bool regular = true;  ///< a lattice: the cells tile the body without overlap
};

/// reference, drawn: positions per point, rows of 3.  volume: per point; gives the relative sizes of the cells.  lone: per point, or empty; whether
/// it is on its own and has no part in the cells of others.
PointCells make_point_cells(int dimension, std::span<const double> reference, std::span<const double> drawn,
                            std::span<const double> volume, const std::vector<bool>& lone = {});

}  // namespace perikit
