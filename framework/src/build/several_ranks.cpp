#include "build/several_ranks.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "build/cloud_points.hpp"
#include "perikit/core/communicator.hpp"

namespace perikit {

void refuse_on_ranks(const Scene& scene, const IntegratorTraits& integrator) {
  if (communicator().size() == 1 || integrator.several_ranks) return;
  throw InputError(scene.integrator->values.position("type"), "integrator.type",
                   fmt::format("found \"{}\" on {} ranks; allowed: integrators that need no matrix (explicit ones; Krylov solvers with "
                               "preconditioner = \"companion\", \"mixed\" of jfnk, or \"none\"), or one rank with many threads (--threads)",
                               scene.integrator->type, communicator().size()));
}

std::string needs_whole_body(const Scene& scene, bool quasi_static) {
  using Type = LoadDescription::Type;
  if (scene.body.voronoi) return "Voronoi cells are found of all points together";
  if (quasi_static) return "pieces that nothing holds are looked for";
  if (!scene.symmetries.empty() || !scene.periodics.empty())
    return "there are images beyond planes of symmetry or periodic sides";
  if (std::ranges::any_of(scene.boundaries, [](const BoundaryDescription& boundary) { return boundary.holds_side(); }))
    return "there are images beyond held faces or surfaces";
  // On clouds a traction asks each point how deep it lies, and no neighbours.
  if (std::ranges::any_of(scene.loads, [&](const LoadDescription& load) {
        return load.type == Type::pressure || (load.type == Type::traction && !is_cloud(scene));
      }))
    return "tractions and pressures share out the surface";
  return {};
}

}  // namespace perikit
