#include <fmt/format.h>

#include <cstdlib>

#include "perikit/core/communicator.hpp"
#include "perikit/core/errors.hpp"
#include "perikit/core/library_beside.hpp"

namespace perikit {

namespace {

/// How launchers tell a process who it is. SLURM_NTASKS is set in job scripts too, which run once: srun alone sets the number of
/// tasks of the step.
constexpr struct {
  const char *size, *rank;
} launchers[] = {
    {"OMPI_COMM_WORLD_SIZE", "OMPI_COMM_WORLD_RANK"}, {"PMI_SIZE", "PMI_RANK"}, {"SLURM_STEP_NUM_TASKS", "SLURM_PROCID"}};

constexpr const char* library = "libperikit_mpi.so";

int number(const char* variable, int otherwise) {
  const char* text = std::getenv(variable);
  if (!text) return otherwise;
  char* end = nullptr;
  const long value = std::strtol(text, &end, 10);
  return end != text && *end == '\0' && value >= 0 && value < 1 << 30 ? static_cast<int>(value) : otherwise;
}

}  // namespace

Launch find_launch() {
  for (const auto& [size, rank] : launchers)
    if (const int ranks = number(size, 0); ranks > 0) return {number(rank, 0), ranks, size};
  return {};
}

std::unique_ptr<Communicator> join_ranks(const Launch& launch) {
  if (launch.size == 1) return nullptr;
  const auto refuse = [&](const std::string& why) {
    throw InputError(
        fmt::format("found {} processes of one run ({} = {}), but {}", launch.size, launch.variable, launch.size, why));
  };
  std::string why;
  std::unique_ptr<Communicator> ranks(static_cast<Communicator*>(made_by_library(library, "perikit_mpi_ranks", why)));
  if (!ranks) refuse(why + "; allowed: one process, or a perikit that was built where MPI is installed");
  if (ranks->size() != launch.size)
    refuse(fmt::format(
        "MPI knows of {}: the launcher belongs to another MPI than {}; allowed: the mpirun of that MPI, or srun with its --mpi",
        ranks->size(), library));
  return ranks;
}

}  // namespace perikit
