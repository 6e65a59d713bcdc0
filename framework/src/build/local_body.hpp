#pragma once
#include <memory>
#include <optional>

#include "perikit/body/partition.hpp"
#include "perikit/scene/scene.hpp"

namespace perikit {

/// A rank's part of a body that no rank has as a whole.
struct LocalBody {
  std::unique_ptr<Partition> partition;
  Body body;
  Lattice whole;
};

/// The part of this rank of the scene's lattice, with its sets and materials, asked of its own cells and those within reach
/// alone. far_material: of far points. Nothing where the scene keeps so few cells that they are a cloud. All ranks must call it.
/// Throws InputError as build_body, and std::domain_error as Partition.
std::optional<LocalBody> build_local_body(const Scene& scene, const Partition::Reach& reach, std::uint16_t far_material);

}  // namespace perikit
