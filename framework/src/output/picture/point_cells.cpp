#include "output/picture/point_cells.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

namespace perikit {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Vector3d point(std::span<const double> rows, std::size_t p) {
  return Eigen::Map<const Vector3d>(&rows[3 * p]);
}

/// Mean distance to the `dimension` nearest neighbours (even the corner of a lattice has as many at one spacing), for a sample of
/// points, sorted.
std::vector<double> sample_spacings(int dimension, std::span<const double> rows) {
  constexpr std::size_t sample_size = 200;
  const std::size_t points = rows.size() / 3;
  const std::size_t step = std::max<std::size_t>(1, points / sample_size);
  std::vector<double> spacings;
  for (std::size_t p = step / 2; p < points; p += step) {
    std::array<double, 3> nearest;
    nearest.fill(std::numeric_limits<double>::infinity());
    double& last = nearest[static_cast<std::size_t>(dimension - 1)];
    for (std::size_t q = 0; q < points; ++q) {
      if (q == p) continue;
      const double distance = (point(rows, q) - point(rows, p)).squaredNorm();
      if (distance >= last) continue;
      last = distance;
      std::sort(nearest.begin(), nearest.end());  // unused places stay infinite, at the end
    }
    if (!std::isfinite(last)) continue;
    double sum = 0;
    for (const double square : nearest) sum += std::isfinite(square) ? std::sqrt(square) : 0;
    spacings.push_back(sum / dimension);
  }
  std::sort(spacings.begin(), spacings.end());
  return spacings;
}

/// Points hashed by cubes of the search radius.
class NeighbourSearch {
 public:
  NeighbourSearch(std::span<const double> rows, double radius) : rows_(rows), radius_(radius), next_(rows.size() / 3, none) {
    heads_.assign(std::max<std::size_t>(1, next_.size()), none);
    for (std::size_t p = 0; p < next_.size(); ++p) {
      std::size_t& head = heads_[bucket(cube(p))];
      next_[p] = std::exchange(head, p);
    }
  }

  template <class Visit>
  void each(std::size_t p, Visit visit) const {
    const Cube centre = cube(p);
    for (std::int64_t dx = -1; dx <= 1; ++dx) {
      for (std::int64_t dy = -1; dy <= 1; ++dy) {
        for (std::int64_t dz = -1; dz <= 1; ++dz) {
          const Cube wanted{centre[0] + dx, centre[1] + dy, centre[2] + dz};
          for (std::size_t q = heads_[bucket(wanted)]; q != none; q = next_[q]) {
            if (q == p || cube(q) != wanted) continue;
            if ((point(rows_, q) - point(rows_, p)).squaredNorm() <= radius_ * radius_) visit(q);
          }
        }
      }
    }
  }

 private:
  using Cube = std::array<std::int64_t, 3>;
  static constexpr std::size_t none = std::numeric_limits<std::size_t>::max();
  Cube cube(std::size_t p) const {
    Cube result;
    for (std::size_t c = 0; c < 3; ++c) result[c] = static_cast<std::int64_t>(std::floor(rows_[3 * p + c] / radius_));
    return result;
  }
  std::size_t bucket(const Cube& cube) const {
    const auto mixed = static_cast<std::uint64_t>(cube[0]) * 73856093u ^ static_cast<std::uint64_t>(cube[1]) * 19349663u ^
                       static_cast<std::uint64_t>(cube[2]) * 83492791u;
    return mixed % heads_.size();
  }

  std::span<const double> rows_;
  double radius_;
  std::vector<std::size_t> heads_, next_;
};

}  // namespace

PointCells make_point_cells(int dimension, std::span<const double> reference, std::span<const double> drawn,
                            std::span<const double> volume, const std::vector<bool>& lone) {
  PointCells result;
  const std::size_t points = volume.size();
  const std::vector<double> spacings = sample_spacings(dimension, reference);
  result.spacing = spacings.empty() ? 1.0 : spacings[spacings.size() / 2];
  result.regular = spacings.empty() || spacings[spacings.size() * 9 / 10] < 1.1 * spacings[spacings.size() / 10];
  std::vector<double> sorted(volume.begin(), volume.end());
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(points / 2), sorted.end());
  const double median_volume = sorted[points / 2];

  constexpr double torn = 4;  // neighbours that far apart no longer belong together
  const NeighbourSearch search(reference, (result.regular ? 1.6 : 2.2) * result.spacing);
  for (std::size_t p = 0; p < points; ++p) {
    // Least squares for the local deformation; the weights fade for neighbours across a crack. The small multiple of the identity
    // keeps directions without neighbours as they are.
    const double keep = 1e-6 * result.spacing * result.spacing;
    Matrix3d shape = keep * Matrix3d::Identity(), moved = shape;
    Vector3d outwards = Vector3d::Zero();
    const double size = result.spacing * std::pow(volume[p] / median_volume, 1.0 / dimension);
    if (!lone.empty() && lone[p]) {
      result.cells.push_back({point(drawn, p), 0.5 * size * Matrix3d::Identity(), true, Vector3d::Zero()});
      continue;
    }
    search.each(p, [&](std::size_t q) {
      if (!lone.empty() && lone[q]) return;
      const Vector3d bond = point(reference, q) - point(reference, p), now = point(drawn, q) - point(drawn, p);
      const double length = bond.norm();
      if (length == 0 || now.norm() > torn * length) return;
      const double change = (now - bond).squaredNorm() / (length * length);
      const double weight = 1 / ((0.01 + change) * (0.01 + change));
      shape += weight * bond * bond.transpose();
      moved += weight * now * bond.transpose();
      outwards -= bond / length;
    });
    const Matrix3d deformation = moved * shape.inverse();
    Vector3d normal = Vector3d::Zero();
    if (outwards.norm() > 0.8) normal = (deformation.inverse().transpose() * outwards).normalized();
    if (!normal.allFinite()) normal.setZero();
    result.cells.push_back({point(drawn, p), 0.5 * size * deformation, false, normal});
  }
  return result;
}

}  // namespace perikit
