#pragma once
/// Whether the outermost points of a cloud lie on its side, as their volumes say.

#include <functional>

namespace perikit {

/// Mean volumes of the points of a layer, 0 where there are none, and of those less than two spacings behind it.
struct OuterLayer {
  double outer = 0, inner = 0;
  bool between = false;  ///< whether points lie near the layer, but not in it

  /// Points on a side have half of the cells that others have. Between a half and a whole cell over those behind:
  static constexpr double half = 0.75;
  bool clear() const noexcept { return !between && inner > 0; }
  bool half_cells() const noexcept { return outer > 0 && inner > 0 && outer < half * inner; }
};

/// visit: calls its argument with the depth below the layer [m] and the volume of each point. shared: ranks have points of their own, and all of
/// them must call it.
using LayerPoints = std::function<void(const std::function<void(double depth, double volume)>& point)>;
OuterLayer outer_layer(double spacing, bool shared, const LayerPoints& visit);

}  // namespace perikit
