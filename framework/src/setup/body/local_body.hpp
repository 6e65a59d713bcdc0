#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "body/partition/partition.hpp"
#include "perikit/body/images.hpp"
#include "perikit/problem/constraints.hpp"
#include "scene/scene.hpp"

namespace perikit {

/// A rank's part of a body that no rank has as a whole.
struct LocalBody {
  std::unique_ptr<Partition> partition;
  Body body;
  std::vector<std::uint16_t> material;  ///< by input number of the part: as in the whole body, also of far points
  std::optional<Images> images;         ///< those that the part has, of bodies that have any on whatever rank
  std::vector<FaceMotion> motions;      ///< of these
  std::vector<std::string> notes;       ///< where sides were found to lie
};

/// The part of this rank of the scene's body, with its sets and materials. Of a lattice it asks its own cells and those within
/// reach alone; of a cloud ranks make runs of points in the order of the input, and give each other those that they need.
/// far_material: of far points; image_material: of images. All ranks must call it. Throws InputError as build_body, and
/// std::domain_error as Partition.
LocalBody build_local_body(const Scene& scene, const Partition::Reach& reach, std::uint16_t far_material, std::uint16_t image_material = 0, bool quasi_static = false);

}  // namespace perikit
