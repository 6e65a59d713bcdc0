#pragma once
/// Points of a cloud at which a constant stress is to be in equilibrium: all inside of the body, and, near its surface, in the
/// directions along that.
///
/// A cell is open where its Voronoi cell has a corner more than 1.5 spacings away. Points without a bond to an open one, nor to
/// one with bonds that a pre-crack cuts, are whole: nothing is missing around them. Near a surface with the normal n a constant
/// stress must leave forces, P A_k with A_k along n, which tractions balance or which vanish where P n = 0, as at a free surface;
/// the other components of A_k are zero on lattices.

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "families/families.hpp"

namespace perikit {

struct ClosedPoints {
  /// Not whole, but balanced in directions that `along`, a projection, row-major 3 x 3, keeps.
  struct AtSurface {
    std::int32_t point;
    std::array<double, 9> along;
  };
  std::vector<std::int32_t> whole;
  std::vector<AtSurface> at_surfaces;
};

/// The components of A_k that are to vanish.
class ClosedComponents {
 public:
  ClosedComponents(ClosedPoints closed, const Body& body);

  const Body& body() const noexcept { return body_; }
  /// y of the other components <- 0; component d and later ones of y stay.
  void project(FieldView y) const;
  /// Largest |y| of a point over volume and spacing, and where it is.
  double largest(ConstFieldView y, Point* where = nullptr) const;
  /// Asks for nothing any more at points where |y| over volume and spacing is above this: at those near surfaces or, where there
  /// are none, at whole ones. How many there were.
  std::size_t let_go(ConstFieldView y, double above);
  const ClosedPoints& points() const noexcept { return closed_; }

 private:
  /// |y| of a point over volume and spacing.
  double magnitude(ConstFieldView y, std::size_t p) const;

  ClosedPoints closed_;
  const Body& body_;
  std::vector<std::uint8_t> whole_;  ///< by point
};

/// Of the volume that belongs to a point [m].
double spacing_of(const Body& body, std::size_t p);
double spacing_of(const Body& body, double volume);

/// Of the points that the body owns. copy_from_sources: values of points -> their images; may be empty.
ClosedPoints find_closed_points(const Families& families, const std::function<void(FieldView)>& copy_from_sources);

}  // namespace perikit
