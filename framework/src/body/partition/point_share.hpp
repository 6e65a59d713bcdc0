#pragma once
#include <functional>

#include "body/points/point_file.hpp"

namespace perikit {

/// As read_points, of which each rank gets a run: those of lower ranks come before in the file. What is wrong with the points is
/// what read_points would say. All ranks must call it; a rank without others gets all points.
PointCloud read_run_of_points(const std::filesystem::path& file, int dimension);

/// The same without volumes, which are 1.
PointCloud read_run_of_positions(const std::filesystem::path& file, int dimension);

/// use(points) until it has had all, in the order of the file, of which no more than a piece is in memory. Throws as read_points.
void over_points_of_file(const std::filesystem::path& file, int dimension, const std::function<void(const PointCloud&)>& use);

}  // namespace perikit
