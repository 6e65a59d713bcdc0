#pragma once
/// `perikit check --machine`: whether this build computes on this machine what other builds computed.

#include <filesystem>
#include <stdexcept>
#include <string>

#include "plugin/registry.hpp"

namespace perikit::app {

/// This build computes something else, or crashes: which part, on which body, by how much, and what to do.
class WrongBuild : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Evaluates the energy and the forces of every kinematics and every law on small bodies, each part in a process of its own, and compares
/// them with `stored`. Returns a line that says what was compared. Throws WrongBuild where something differs, InputError for a file that cannot be read.
std::string check_machine(Registry& registry, const std::filesystem::path& stored);

/// Writes the values of this build to `file`, for builds to come.
void store_machine_values(Registry& registry, const std::filesystem::path& file);

}  // namespace perikit::app
