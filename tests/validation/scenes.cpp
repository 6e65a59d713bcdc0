#include "tests/validation/scenes.hpp"

namespace perikit::validation {

Registry& registry() {
  Registry& parts = contract::subject().registry;
  static const bool filled = [&] {
    for (const auto& folder : Registry::standard_search_path({PERIKIT_PLUGIN_FOLDER})) parts.add_folder(folder);
    return true;
  }();
  static_cast<void>(filled);
  return parts;
}

std::unique_ptr<Simulation> load(const std::string& scene, std::vector<std::string> overrides) {
  const std::string file = std::string(PERIKIT_SOURCE_FOLDER) + "/configs/" + scene;
  return std::make_unique<Simulation>(read_scene(file, registry(), {.overrides = std::move(overrides)}), registry());
}

}  // namespace perikit::validation
