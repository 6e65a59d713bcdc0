#pragma once
/// Which points of a body lie at its free surface.

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "perikit/body/body.hpp"
#include "perikit/problem/image_map.hpp"

namespace perikit {

/// The free faces of the cells of some points of a lattice: those with no point, and no image, behind them. axis: of the input.
using FreeFace = std::function<void(std::int32_t p, std::size_t axis, int sign)>;
void over_free_faces(const Body& body, std::span<const std::int32_t> points, const FreeFace& visit);

/// Owned points at the free surface. Lattices: with a free cell face. Clouds: outside of which, along the mean direction away
/// from the points around, no other point lies within two spacings, or within the horizon where that is less.
std::vector<std::int32_t> free_surface(const Body& body);

/// A point at the surface.
struct SurfacePoint {
  Point x;
  std::int64_t chosen;  ///< 1: of the set that is asked for
};

/// A point below chosen points of the surface. In a corner between a chosen and another face several are equally near: either face has its share.
struct PointBelow {
  std::int32_t p;   ///< internal index
  double share;
};

/// The points whose nearest points of the surface are chosen, no farther than `most` [m], then images of these; all whose forces are complete here.
/// candidate(p): whether p may be one of them. surface: of this rank; all ranks must call it.
std::vector<PointBelow> points_below(const Body& body, const std::vector<SurfacePoint>& surface, double most, const ImageMap* images,
                                     const std::function<bool(std::int32_t)>& candidate);

}  // namespace perikit
