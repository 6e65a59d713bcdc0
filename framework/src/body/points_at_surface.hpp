#pragma once
/// The points of a body next to a surface.

#include <map>
#include <vector>

#include "body/level_surface.hpp"

namespace perikit {

class PointsAtSurface {
 public:
  PointsAtSurface(const Body& body, const LevelSurface& surface);

  /// Internal indices.
  const std::vector<std::int32_t>& points() const noexcept { return points_; }
  /// Input number of the nearest to a place of the surface, of those less than three spacings away; `otherwise` where there are
  /// none.
  std::int32_t nearest(const Point& foot, std::int32_t otherwise) const;

 private:
  using Cell = std::array<std::int64_t, 3>;
  Cell cell(const Point& x) const;

  const Body& body_;
  std::vector<std::int32_t> points_;
  std::map<Cell, std::vector<std::int32_t>> cells_;  ///< of three spacings
};

}  // namespace perikit
