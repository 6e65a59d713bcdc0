#include "build/several_ranks.hpp"

#include <fmt/format.h>

#include "perikit/core/communicator.hpp"

namespace perikit {

void refuse_on_ranks(const Scene& scene, const IntegratorTraits& integrator) {
  const int ranks = communicator().size();
  if (ranks == 1) return;
  const auto refuse = [&](const SourcePosition& position, const std::string& key, const std::string& what,
                          const std::string& instead) {
    throw InputError(position, key, fmt::format("found {} on {} ranks; allowed: {}", what, ranks, instead));
  };
  const std::string threads = "one rank with many threads (--threads)";
  if (!integrator.several_ranks)
    refuse(scene.integrator->values.position("type"), "integrator.type", fmt::format("\"{}\"", scene.integrator->type),
           fmt::format("integrators that need no matrix (explicit ones; Krylov solvers with preconditioner = \"companion\" or \"none\"), or {}",
                       threads));
  if (scene.weak_springs > 0) refuse(scene.weak_springs_position, "run.weak_springs", "springs on loose pieces", threads);
  if (scene.damage && integrator.quasi_static)
    refuse(scene.damage->values.position(""), "damage", fmt::format("bonds that may fail with \"{}\"", scene.integrator->type),
           fmt::format("explicit integrators, or {}", threads));
}

}  // namespace perikit
