#pragma once
/// Where materials meet. The surface between two of them goes through the midpoints of the bonds between nearest points of
/// either side; each point near it knows its distance from it, and where its counterpart lies. Cracks do not move it: what they
/// part has no stencil that sees both sides.

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "perikit/body/body.hpp"

namespace perikit {

/// Of two materials: signed distances of their points near the surface between them.
struct Interface {
  std::uint16_t first = 0, second = 0;    ///< the distance is negative in the first material, positive in the second
  std::vector<std::int32_t> point;        ///< internal indices, ascending
  std::vector<double> distance;           ///< [m]
  std::vector<std::int32_t> counterpart;  ///< a point of the other material, of the nearest pair

  /// Place of a point among them, or -1.
  std::ptrdiff_t find(std::int32_t p) const noexcept;
};

/// Of a body, or a rank's part of it, with its images.
struct Interfaces {
  std::vector<std::uint16_t> material;  ///< by internal index: also of images and ghosts the one of the point itself
  std::vector<std::int32_t> source;     ///< by internal index: of images the point itself
  std::vector<Interface> all;
  std::vector<std::pair<std::uint16_t, std::uint16_t>> pairs;  ///< materials that meet, on whatever rank, ascending
  std::vector<std::string> notes;  ///< for run.log
  double length = 0;               ///< the horizon [m]

  bool empty() const noexcept { return all.empty(); }
};

/// Those of a body, or of this rank's part of a body, between any two of its materials on whatever rank. material: of its points, by input
/// number, also of far points, those of images after them; equal numbers where laws and constants are equal. sources: input numbers of what the
/// images are images of. Distances are known up to `reach` [m]. All ranks that have a part must call it.
Interfaces find_interfaces(const Body& body, std::span<const std::uint16_t> material, std::span<const std::int32_t> sources,
                           double reach);

}  // namespace perikit
