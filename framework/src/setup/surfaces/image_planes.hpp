#pragma once
/// From [[boundary]] with face or surface, [[symmetry]] and [[periodic]] to the planes and surfaces that points have images behind.

#include <string>
#include <vector>

#include "perikit/body/images.hpp"
#include "perikit/problem/constraints.hpp"
#include "scene/scene.hpp"
#include "setup/body/placed_points.hpp"

namespace perikit {

struct ScenePlanes {
  struct Origin {
    std::string key, set;                ///< what asks for it in the scene, and whose side it is
    SourcePosition position;
  };
  std::vector<ImagePlane> planes;
  std::vector<Origin> origins;           ///< of the planes
  std::vector<ImageSurface> surfaces;
  std::vector<std::string> notes;        ///< where sides of clouds were found to lie
  std::vector<FaceMotion> motions;       ///< what ImagePlane::motion and ImageSurface::motion number
};

/// Throws InputError for faces without points, planes through the body, faces held twice, and as add_surfaces. All ranks must
/// call it.
ScenePlanes build_planes(const Scene& scene, const std::shared_ptr<const PlacedPoints>& points, bool quasi_static);

/// Says which side has something beyond it that is in the way of images.
[[noreturn]] void refuse_overlap(const ScenePlanes& planes, const OverlappingImage& error);

}  // namespace perikit
