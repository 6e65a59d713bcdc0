#include "scene/geometry_checks.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace perikit {

double lattice_point_count(const LatticeDescription& lattice, int dimension) {
  double count = 1.0;
  for (std::size_t axis = 0; axis < static_cast<std::size_t>(dimension); ++axis) {
    // (k + 1/2) spacing <= extent; the slack forgives the rounding of extents that are a multiple of the spacing
    count *= std::floor((lattice.upper[axis] - lattice.lower[axis]) / lattice.spacing + 0.5 + 1e-9);
  }
  return count;
}

std::string crack_fault(const std::vector<std::array<double, 3>>& vertices) {
  const auto at = [&](std::size_t i) { return Eigen::Map<const Eigen::Vector3d>(vertices[i % vertices.size()].data()); };
  double size = 0.0;
  for (std::size_t i = 0; i < vertices.size(); ++i) size = std::max(size, (at(i) - at(0)).norm());
  if (!(size > 0.0)) return "all vertices at one place";
  if (vertices.size() == 2) return {};

  Eigen::Vector3d area = Eigen::Vector3d::Zero();  // twice the area vector, relative to size^2
  for (std::size_t i = 0; i < vertices.size(); ++i) area += ((at(i) - at(0)) / size).cross((at(i + 1) - at(0)) / size);
  if (area.norm() < 1e-9) return "vertices on one line";
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const double distance = std::abs(area.normalized().dot((at(i) - at(0)) / size));
    if (distance > 1e-6) return fmt::format("vertex {} off the plane by {:.3g} of the crack's size", i, distance);
  }
  return {};
}

}  // namespace perikit
