#pragma once
/// checkpoint.h5: everything that a run continues from, bit for bit.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "problem/snapshot.hpp"
#include "run/simulation.hpp"

namespace perikit {

struct Checkpoint {
  std::string perikit_version;
  std::string scene;             ///< resolved
  std::string body;              ///< fingerprint of points, volumes, materials and sets
  std::string libraries;         ///< of parts that are used: a line "name fingerprint" for each
  OutputProgress output;
  std::int64_t step = 0;
  double time = 0;
};

/// One that is being written, with a state of so many bytes (BodyProblem::write_snapshot). It takes the place of the folder's
/// earlier one when it is kept. Throws RunError; an earlier one is then untouched.
class NewCheckpoint {
 public:
  NewCheckpoint(const std::filesystem::path& folder, const Checkpoint& checkpoint, std::uint64_t state_size);
  ~NewCheckpoint();
  void add(std::span<const std::byte> state);
  void keep();

 private:
  struct File;
  std::unique_ptr<File> file_;
};

std::filesystem::path checkpoint_file(const std::filesystem::path& folder);
std::string body_fingerprint(const ReferenceData& body);

/// Throws InputError where it cannot be read, or is not byte for byte what was written.
Checkpoint read_checkpoint(const std::filesystem::path& folder);
/// Its state, from the disk as it is read. `shared`: rank 0 reads it, and tells it to the others, which must all read the same of
/// it.
ByteReader checkpoint_state(const std::filesystem::path& folder, bool shared = false);

/// Throws InputError saying what differs where `checkpoint` does not belong to this scene, body, version and libraries. True where the scene
/// has another end of the run, and no other difference.
bool check_checkpoint(const Checkpoint& checkpoint, const Scene& scene, const std::string& body, const std::string& libraries,
                      const std::filesystem::path& folder);

/// Throws InputError naming the keys where the scene of an earlier run in `folder` was another. may_lengthen: end and steps of the
/// integrator may differ; true where they do.
bool check_same_scene(const std::string& before, const Scene& scene, const std::filesystem::path& folder, bool may_lengthen = false);

}  // namespace perikit
