#include "build/several_ranks.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "build/sets.hpp"
#include "perikit/core/communicator.hpp"

namespace perikit {

void refuse_on_ranks(const Scene& scene, const IntegratorTraits& integrator) {
  if (communicator().size() == 1 || integrator.several_ranks) return;
  throw InputError(scene.integrator->values.position("type"), "integrator.type",
                   fmt::format("found \"{}\" on {} ranks; allowed: integrators that need no matrix (explicit ones; Krylov solvers with "
                               "preconditioner = \"companion\", \"mixed\" of jfnk, or \"none\"), or one rank with many threads (--threads)",
                               scene.integrator->type, communicator().size()));
}

bool has_images(const Scene& scene) {
  return !scene.symmetries.empty() || !scene.periodics.empty() ||
         std::ranges::any_of(scene.boundaries, [](const BoundaryDescription& boundary) { return boundary.holds_side(); });
}

namespace {

/// Whether planes are asked of single points of a lattice, which only their owners know.
bool faces_of_single_points(const Scene& scene) {
  return std::ranges::any_of(scene.boundaries, [&](const BoundaryDescription& boundary) {
    return !boundary.face.empty() && boundary.set != "all" && !set_expression(scene, boundary.set);
  });
}

}  // namespace

std::string needs_whole_body(const Scene& scene) {
  if (scene.body.voronoi) return "Voronoi cells are found of all points together";
  if (!has_images(scene)) return {};
  if (std::ranges::any_of(scene.boundaries, [](const BoundaryDescription& boundary) { return boundary.surface.has_value(); }))
    return "there are images beyond held surfaces";
  if (faces_of_single_points(scene)) return "a face of a set of single points is held";
  return {};
}

}  // namespace perikit
