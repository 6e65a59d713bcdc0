#pragma once
/// A surface where a function of the place, negative in front of it, is zero: feet of places on it, and what its curvature does
/// to mirrored volumes.

#include <functional>
#include <optional>

#include "perikit/body/body.hpp"

namespace perikit {

/// The place of a surface that is nearest to another one.
struct Foot {
  Point at{};
  double depth = 0;  ///< of the place: in front of the surface (positive) or behind it [m]
  /// Volume of the mirror image of a small piece of the body around the place over its own, det(I + s S)/det(I - s S) with the
  /// shape operator S of the surface and the depth s; 0 where the place or its image lies near a centre of curvature or beyond.
  double stretch = 0;
};

class LevelSurface {
 public:
  /// spacing: of the points around; the function is taken as smooth over a hundredth of it.
  LevelSurface(std::function<double(const Point&)> level, int dimension, double spacing);

  double level(const Point& x) const { return level_(x); }
  /// Distance as the gradient has it, which is infinite where that vanishes; the sign is that of a depth.
  double estimate(const Point& x) const;
  /// Newton's method along gradients; nullopt where it finds no foot.
  std::optional<Foot> foot(const Point& x) const;

 private:
  std::function<double(const Point&)> level_;
  int dimension_;
  double spacing_;
};

}  // namespace perikit
