#pragma once
/// Images of cracks behind curved surfaces. They are curved, too: pieces of a spacing or less, each as good as plane, take their place.

#include <functional>
#include <optional>
#include <vector>

#include "perikit/body/body.hpp"

namespace perikit {

struct CurvedMirror {
  std::function<double(const Point&)> level;                ///< negative in front of it
  std::function<std::optional<Point>(const Point&)> image;  ///< nullopt: the place has none
  double piece = 0;                                         ///< how long a piece is at most [m]
};

/// Appends images of what of the cracks lies in front of the mirror.
void mirror_cracks(const CurvedMirror& mirror, std::vector<Crack>& cracks);

}  // namespace perikit
