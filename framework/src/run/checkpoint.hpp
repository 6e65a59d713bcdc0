#pragma once
/// checkpoint.h5: everything that a run continues from, bit for bit.

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "perikit/run/simulation.hpp"

namespace perikit {

struct Checkpoint {
  std::string perikit_version;
  std::string scene;             ///< resolved
  std::string body;              ///< fingerprint of points, volumes, materials and sets
  std::string libraries;         ///< of parts that are used: a line "name fingerprint" for each
  OutputProgress output;
  std::int64_t step = 0;
  double time = 0;
  std::vector<std::byte> state;  ///< Problem::snapshot
};

std::filesystem::path checkpoint_file(const std::filesystem::path& folder);
std::string body_fingerprint(const ReferenceData& body);

/// Replaces the checkpoint of the folder. Throws RunError; an earlier one is then untouched.
void write_checkpoint(const std::filesystem::path& folder, const Checkpoint& checkpoint);
/// Throws InputError where it cannot be read, or is not byte for byte what was written.
Checkpoint read_checkpoint(const std::filesystem::path& folder);

/// Throws InputError saying what differs where `checkpoint` does not belong to this scene, body, version and libraries. True where the scene
/// has another end of the run, and no other difference.
bool check_checkpoint(const Checkpoint& checkpoint, const Scene& scene, const std::string& body, const std::string& libraries,
                      const std::filesystem::path& folder);

/// Throws InputError naming the keys where the scene of an earlier run in `folder` was another. may_lengthen: end and steps of the
/// integrator may differ; true where they do.
bool check_same_scene(const std::string& before, const Scene& scene, const std::filesystem::path& folder, bool may_lengthen = false);

}  // namespace perikit
