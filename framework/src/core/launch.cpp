#include <dlfcn.h>
#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>

#include "perikit/core/communicator.hpp"
#include "perikit/core/errors.hpp"

namespace perikit {

namespace {

/// How launchers tell a process who it is. SLURM_NTASKS is set in job scripts too, which run once: srun alone sets the number of
/// tasks of the step.
constexpr struct {
  const char *size, *rank;
} launchers[] = {
    {"OMPI_COMM_WORLD_SIZE", "OMPI_COMM_WORLD_RANK"}, {"PMI_SIZE", "PMI_RANK"}, {"SLURM_STEP_NUM_TASKS", "SLURM_PROCID"}};

constexpr const char* library_name = "libperikit_mpi.so";
constexpr const char* factory_name = "perikit_mpi_ranks";

int number(const char* variable, int otherwise) {
  const char* text = std::getenv(variable);
  if (!text) return otherwise;
  char* end = nullptr;
  const long value = std::strtol(text, &end, 10);
  return end != text && *end == '\0' && value >= 0 && value < 1 << 30 ? static_cast<int>(value) : otherwise;
}

/// The library lies beside this one.
std::filesystem::path library_file() {
  Dl_info here{};
  dladdr(reinterpret_cast<const void*>(&find_launch), &here);
  return std::filesystem::path(here.dli_fname ? here.dli_fname : "").parent_path() / library_name;
}

}  // namespace

Launch find_launch() {
  for (const auto& [size, rank] : launchers)
    if (const int ranks = number(size, 0); ranks > 0) return {number(rank, 0), ranks, size};
  return {};
}

std::unique_ptr<Communicator> join_ranks(const Launch& launch) {
  if (launch.size == 1) return nullptr;
  const std::filesystem::path file = library_file();
  const auto refuse = [&](const std::string& why) {
    throw InputError(
        fmt::format("found {} processes of one run ({} = {}), but {}", launch.size, launch.variable, launch.size, why));
  };
  void* const library = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!library)
    refuse(fmt::format("{} cannot be opened: {}; allowed: one process, or a perikit that was built where MPI is installed",
                       file.string(), dlerror()));
  using Factory = Communicator* (*)(const char* version);
  const auto factory = reinterpret_cast<Factory>(dlsym(library, factory_name));
  if (!factory) refuse(fmt::format("{} is no library of perikit", file.string()));
  std::unique_ptr<Communicator> ranks(factory(PERIKIT_VERSION));
  if (!ranks) refuse(fmt::format("{} belongs to another perikit than this one, {}", file.string(), PERIKIT_VERSION));
  if (ranks->size() != launch.size)
    refuse(fmt::format(
        "MPI knows of {}: the launcher belongs to another MPI than {}; allowed: the mpirun of that MPI, or srun with its --mpi",
        ranks->size(), file.string()));
  return ranks;
}

}  // namespace perikit
