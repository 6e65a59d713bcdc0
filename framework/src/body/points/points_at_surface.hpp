#pragma once
/// The points of a cloud next to a surface.

#include <map>

#include "body/partition/streamed_cloud.hpp"
#include "body/points/level_surface.hpp"

namespace perikit {

class PointsAtSurface {
 public:
  using Points = CloudShares::Points;
  /// points: those that this rank looks at; shared: other ranks look at others, and all of them must call it.
  PointsAtSurface(const BodyFrame& frame, const LevelSurface& surface, const PointStream& points, bool shared);

  /// Those that this rank looks at, and whether no rank has any.
  const Points& mine() const noexcept { return mine_; }
  bool none() const noexcept { return cells_.empty(); }
  /// Number of the nearest to a place of the surface, on whatever rank, of those less than three spacings away; `otherwise` where
  /// there are none.
  std::int64_t nearest(const Point& foot, std::int64_t otherwise) const;

 private:
  using Cell = std::array<std::int64_t, 3>;
  Cell cell(const Point& x) const;

  int dimension_;
  double spacing_;
  Points mine_;
  std::map<Cell, Points> cells_;  ///< of three spacings
};

}  // namespace perikit
