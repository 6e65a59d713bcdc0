#pragma once
/// Which points of a body lie at its free surface.

#include <cstdint>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "perikit/body/body.hpp"

namespace perikit {

/// The free faces of the cells of some points of a lattice: those with no point, and no image, behind them. axis: of the input.
using FreeFace = std::function<void(std::int32_t p, std::size_t axis, int sign)>;
void over_free_faces(const Body& body, std::span<const std::int32_t> points, const FreeFace& visit);

/// Sum of the outward area vectors of the free faces of each point's cell on a lattice [m^2]: those with no point, and no image,
/// behind them. By internal index; the number of free faces beside it. Of a part right where it has what is around a cell.
struct CellFaces {
  std::vector<Point> area;
  std::vector<std::uint8_t> count;
  explicit CellFaces(const Body& body);
};

/// Owned points at the free surface. Lattices: with a free cell face. Clouds: outside of which, along the mean direction away
/// from the points around, no other point lies within two spacings, or within the horizon where that is less.
std::vector<std::int32_t> free_surface(const Body& body);

/// A point at the surface, of whatever rank.
struct SurfacePoint {
  Point x;
  std::int64_t place;   ///< in the whole body
  std::int64_t chosen;  ///< 1: of the set that is asked for
};

/// The nearest of some points to a place.
class NearestPoint {
 public:
  /// They are looked up in cells of this size [m].
  NearestPoint(std::vector<SurfacePoint> points, double cell);
  /// Not farther than `most` [m]; of equally near ones the one with the smallest place. Null where there is none.
  const SurfacePoint* to(const Point& x, double most) const;

 private:
  std::int64_t key(const std::array<std::int64_t, 3>& cell) const noexcept;
  std::array<std::int64_t, 3> cell_of(const Point& x) const noexcept;

  std::vector<SurfacePoint> points_;
  double cell_;
  Point lower_{};
  std::array<std::int64_t, 3> cells_{1, 1, 1};
  std::vector<std::pair<std::int64_t, std::size_t>> entries_;  ///< (key of the cell, number of the point), ascending
};

}  // namespace perikit
