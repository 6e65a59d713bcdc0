#pragma once
/// Tensor spaces: which components of a second-order tensor a point law sees.
///
/// Component order is row-major in the space of the body, followed by the remaining diagonal components:
///   solid  9: xx xy xz yx yy yz zx zy zz
///   plane  5: xx xy yx yy zz
///   line   3: xx yy zz
/// so that the first d*d components are always the in-space gradient that a kinematics produces.

#include <cstddef>
#include <string_view>

namespace perikit {

enum class Space : int { line_strain, line_stress, plane_strain, plane_stress, solid };

/// Spatial dimension d of the body: 1, 2 or 3.
constexpr int dimension(Space space) noexcept {
  return space == Space::solid ? 3 : (space == Space::plane_strain || space == Space::plane_stress) ? 2 : 1;
}

/// Components of a tensor in this space: 9, 5 or 3.
constexpr int tensor_components(Space space) noexcept {
  const int d = dimension(space);
  return d == 3 ? 9 : d == 2 ? 5 : 3;
}

/// Components of the in-space displacement gradient: d*d.
constexpr int gradient_components(int d) noexcept { return d * d; }

constexpr std::string_view name(Space space) noexcept {
  switch (space) {
    case Space::line_strain: return "uniaxial strain";
    case Space::line_stress: return "uniaxial stress";
    case Space::plane_strain: return "plane strain";
    case Space::plane_stress: return "plane stress";
    case Space::solid: return "solid";
  }
  return "?";
}

}  // namespace perikit
