#include "setup/body/several_ranks.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "perikit/core/communicator.hpp"

namespace perikit {

void refuse_on_ranks(const Scene& scene, const IntegratorTraits& integrator) {
  if (communicator().size() == 1 || integrator.several_ranks) return;
  throw InputError(scene.integrator->values.position("type"), "integrator.type",
                   fmt::format("found \"{}\" on {} ranks; allowed: integrators that need no matrix (explicit ones; Krylov solvers with "
                               "preconditioner = \"companion\", \"mixed\" of jfnk, or \"none\"), or one rank with many threads (--threads)",
                               scene.integrator->type, communicator().size()));
}

bool sets_may_hold_sides(const Scene& scene) {
  // Results of other runs do not say where sides were.
  return scene.body.points_file && !scene.initial_from &&
         std::ranges::any_of(scene.boundaries, [](const BoundaryDescription& boundary) { return !boundary.holds_side(); });
}

bool has_images(const Scene& scene) {
  return sets_may_hold_sides(scene) || !scene.symmetries.empty() || !scene.periodics.empty() ||
         std::ranges::any_of(scene.boundaries, [](const BoundaryDescription& boundary) { return boundary.holds_side(); });
}

}  // namespace perikit
