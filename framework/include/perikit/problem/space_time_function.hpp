#pragma once
/// What a boundary or a load says of one component.

#include <functional>

#include "perikit/body/body.hpp"

namespace perikit {

struct SpaceTimeFunction {
  std::function<double(const Point& x, double t)> value;
  bool depends_on_position = false;
  bool depends_on_time = false;
  bool ramps = false;   ///< times the load parameter; only of values that do not depend on time

  bool varies() const noexcept { return depends_on_time || ramps; }
  double operator()(const Point& x, double t) const { return ramps ? t * value(x, t) : value(x, t); }
};

}  // namespace perikit
