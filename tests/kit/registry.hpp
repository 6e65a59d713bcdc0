#pragma once
/// The parts of this build.

#include <memory>
#include <string>

#include "plugin/registry.hpp"
#include "run/simulation.hpp"

namespace perikit::test {

/// All that the build folder holds, known once.
inline Registry& all_parts() {
  static Registry registry;
  [[maybe_unused]] static const bool filled = (registry.add_folder(PERIKIT_PLUGIN_FOLDER), true);
  return registry;
}

/// A scene, ready to run. file: what messages call it, and where its files lie.
inline std::unique_ptr<Simulation> simulation_of(const std::string& scene, const std::filesystem::path& file = "scene.toml") {
  return std::make_unique<Simulation>(parse_scene(scene, file, all_parts()), all_parts());
}

}  // namespace perikit::test
