#pragma once
/// One Voronoi cell, which other points cut out of a box, one after the other.

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "perikit/body/body.hpp"

namespace voro {
class voronoicell_neighbor;
}

namespace perikit {

class VoronoiCell {
 public:
  struct Corner {
    Point from_point;  ///< over the unit
    double square;     ///< of its length
  };
  /// unit: about the distance between points [m], which tolerances follow.
  VoronoiCell(int dimension, const Point& lower, const Point& upper, double unit);
  ~VoronoiCell();

  /// All of the box is the cell of a point.
  void begin(const Point& x);
  /// The cell of which another rank has these corners: it can be asked what cuts it, and no more.
  void begin(const Point& x, std::span<const Point> corners);

  const std::vector<Corner>& corners() const noexcept { return corners_; }
  /// Square of the distance of the farthest corner from the point [m^2].
  double reach_squared() const noexcept { return farthest_ * unit_ * unit_; }
  /// Whether a piece of the cell is nearer to this point.
  bool cut_by(const Point& y) const noexcept;
  /// Whether it might be to a point of a box; rounding does not make it false.
  bool cut_from(const Point& low, const Point& high) const noexcept;
  /// Leaves out what is nearer to a point.
  void cut(const Point& y, std::int32_t number);

  /// Length, area or volume [m^d].
  double size();
  /// Numbers of the points across its faces.
  std::vector<std::int32_t> neighbours();

 private:
  void clear();
  void find_corners();
  void add_corner(const Point& from_point);

  int dimension_;
  Point lower_, upper_;
  double unit_;
  Point point_{};
  std::vector<Corner> corners_;  ///< none: nothing is left of it
  double farthest_ = 0;          ///< square, over the unit
  // On a line: its ends, and whose they are, -1: of the box.
  double begin_ = 0, end_ = 0;
  std::int32_t before_ = -1, behind_ = -1;
  std::unique_ptr<voro::voronoicell_neighbor> cell_;  ///< in two and three dimensions; a slab of thickness 1 in two
  std::vector<double> vertices_;
};

}  // namespace perikit
