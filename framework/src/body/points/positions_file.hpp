#pragma once
#include "body/points/point_file.hpp"

namespace perikit {

/// The points of a file whose volumes come from elsewhere: a column or dataset `volume` is passed over, and all volumes are 1.
/// Else as read_points.
PointCloud read_positions(const std::filesystem::path& file, int dimension);

}  // namespace perikit
