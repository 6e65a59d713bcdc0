#include "body/points/points_at_surface.hpp"

#include <algorithm>
#include <cmath>

#include "body/images/image_list.hpp"
#include "perikit/core/rank_values.hpp"

namespace perikit {

PointsAtSurface::PointsAtSurface(const BodyFrame& frame, const LevelSurface& surface, const PointStream& points, bool shared)
    : dimension_(dimension(frame.space)), spacing_(frame.spacing) {
  points([&](const CloudShares::OnePoint& point) {
    const double spacing = std::max(spacing_, std::pow(point.volume / frame.section, 1.0 / dimension_)),
                 depth = surface.estimate(point.x);
    if (depth >= -touching(spacing_) && depth <= 1.2 * spacing) mine_.push_back(point);
  });
  const auto add = [&](const Points& found) {
    for (const CloudShares::OnePoint& point : found) cells_[cell(point.x)].push_back(point);
  };
  add(shared ? told_to_all(gathered<CloudShares::OnePoint>(mine_)) : mine_);
}

PointsAtSurface::Cell PointsAtSurface::cell(const Point& x) const {
  Cell cell{};
  for (std::size_t c = 0; c < static_cast<std::size_t>(dimension_); ++c)
    cell[c] = static_cast<std::int64_t>(std::floor(x[c] / (3 * spacing_)));
  return cell;
}

std::int64_t PointsAtSurface::nearest(const Point& foot, std::int64_t otherwise) const {
  const Cell centre = cell(foot);
  double least = 9 * spacing_ * spacing_;
  const auto ring = [&](int axis) { return axis < dimension_ ? 1 : 0; };
  for (int i = -ring(0); i <= ring(0); ++i)
    for (int j = -ring(1); j <= ring(1); ++j)
      for (int k = -ring(2); k <= ring(2); ++k) {
        const auto found = cells_.find({centre[0] + i, centre[1] + j, centre[2] + k});
        if (found == cells_.end()) continue;
        for (const CloudShares::OnePoint& point : found->second) {
          double square = 0;
          for (std::size_t c = 0; c < 3; ++c) square += (point.x[c] - foot[c]) * (point.x[c] - foot[c]);
          if (square >= least) continue;
          least = square;
          otherwise = point.number;
        }
      }
  return otherwise;
}

}  // namespace perikit
