#include "build/several_ranks.hpp"

#include <fmt/format.h>

#include "perikit/core/communicator.hpp"

namespace perikit {

void refuse_on_ranks(const Scene& scene, const IntegratorTraits& integrator) {
  if (communicator().size() == 1 || integrator.several_ranks) return;
  throw InputError(scene.integrator->values.position("type"), "integrator.type",
                   fmt::format("found \"{}\" on {} ranks; allowed: integrators that need no matrix (explicit ones; Krylov solvers with "
                               "preconditioner = \"companion\" or \"none\"), or one rank with many threads (--threads)",
                               scene.integrator->type, communicator().size()));
}

}  // namespace perikit
