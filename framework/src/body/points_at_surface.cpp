#include "body/points_at_surface.hpp"

#include <algorithm>
#include <cmath>

namespace perikit {

PointsAtSurface::PointsAtSurface(const Body& body, const LevelSurface& surface) : body_(body) {
  for (const std::int32_t p : body.owned()) {
    const auto at = static_cast<std::size_t>(p);
    const double spacing = std::max(body.spacing(), std::pow(body.volume(at) / body.section(), 1.0 / body.dimension()));
    const double depth = surface.estimate(body.position(at));
    if (depth < 0 || depth > 1.2 * spacing) continue;
    points_.push_back(p);
    cells_[cell(body.position(at))].push_back(p);
  }
}

PointsAtSurface::Cell PointsAtSurface::cell(const Point& x) const {
  Cell cell{};
  for (std::size_t c = 0; c < static_cast<std::size_t>(body_.dimension()); ++c)
    cell[c] = static_cast<std::int64_t>(std::floor(x[c] / (3 * body_.spacing())));
  return cell;
}

std::int32_t PointsAtSurface::nearest(const Point& foot, std::int32_t otherwise) const {
  const Cell centre = cell(foot);
  double least = 9 * body_.spacing() * body_.spacing();
  const auto ring = [&](int axis) { return axis < body_.dimension() ? 1 : 0; };
  for (int i = -ring(0); i <= ring(0); ++i)
    for (int j = -ring(1); j <= ring(1); ++j)
      for (int k = -ring(2); k <= ring(2); ++k) {
        const auto found = cells_.find({centre[0] + i, centre[1] + j, centre[2] + k});
        if (found == cells_.end()) continue;
        for (const std::int32_t p : found->second) {
          const Point x = body_.position(static_cast<std::size_t>(p));
          double square = 0;
          for (std::size_t c = 0; c < 3; ++c) square += (x[c] - foot[c]) * (x[c] - foot[c]);
          if (square >= least) continue;
          least = square;
          otherwise = body_.input_of(static_cast<std::size_t>(p));
        }
      }
  return otherwise;
}

}  // namespace perikit
