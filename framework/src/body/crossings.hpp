#pragma once
/// Where bonds between nearest points cross the surface between two materials, and how far points lie from it.

#include <cstdint>
#include <span>
#include <vector>

#include "body/points/boxes.hpp"

namespace perikit {

/// A bond between nearest points of two materials, and the plane through the midpoints around it.
struct Crossing {
  std::uint16_t first, second;
  std::int32_t of_first, of_second;  ///< points
  double length;
  Point middle, along;  ///< along: a unit vector from the first material to the second
  Point normal, centre;
};

/// All between the places in `boxes`, of which points are numbers; ascending by materials and points. horizon: the longest [m].
std::vector<Crossing> find_crossings(double horizon, const Boxes& boxes, std::span<const std::uint16_t> material);

/// The lowest coordinates of their midpoints.
Point lowest_middle(std::span<const Crossing> crossings);

/// Distance of a place from the planes of the crossings nearest to it, and the point of the nearest one on the side that x does
/// not lie on.
struct Distance {
  double value = 0;
  std::int32_t counterpart = -1;
};

/// The surface between two materials.
class MaterialSurface {
 public:
  /// crossings: between the two. lower: of the midpoints of all crossings of the body. Distances are known up to `reach` [m].
  MaterialSurface(const Body& body, std::vector<Crossing> crossings, const Point& lower, double reach);

  std::uint16_t first() const noexcept { return crossings_.front().first; }
  std::uint16_t second() const noexcept { return crossings_.front().second; }
  /// Of a place on the side of this material.
  Distance distance(const Point& x, std::uint16_t material) const;

 private:
  std::vector<Crossing> crossings_;
  Boxes middles_;
  double reach_;
};

}  // namespace perikit
