#pragma once
/// Shares of points in a part of a surface.

#include <cstdint>
#include <span>

#include "perikit/problem/surface_rule.hpp"

namespace perikit {

/// Gives the shares s_k of points in a part of a surface [m^2] the sum and the first moments of the samples' weights: s_k + |s_k| (c_0 + c . (X_k - X_0)), the
/// least change in the sense of sum s^2/|s|. What a kinematics has of a whole face holds a uniform stress in equilibrium, whatever its moments; what it
/// has of a part holds none, and points near the edge of the face have shares unlike their cells. Moments along directions in which the points do not
/// spread stay as they are. Of a part of a body all ranks must call it.
void give_first_moments(const Body& body, std::span<const std::int32_t> points, const SurfaceSamples& samples, std::span<double> share);

}  // namespace perikit
