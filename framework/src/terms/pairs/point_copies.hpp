#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "perikit/core/field.hpp"

namespace perikit {

/// How values reach points that are not a rank's own.
struct PointCopies {
  /// field(ghost) <- field(owner), then field(image) <- field(source); null: the body has neither. Fields have up to most_components. All ranks must call it.
  std::function<void(FieldView)> copy;
  static constexpr int most_components = 25;
  /// By internal index: -1 for the axes that an image is mirrored across, else 1; empty: there are no images. 0: beyond a surface that is no such plane, where a bond of
  /// a point with an image has no copy between their sources.
  std::vector<std::array<std::int8_t, 3>> mirrored;
};

}  // namespace perikit
