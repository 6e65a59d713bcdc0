#pragma once
#include <filesystem>
#include <string>

#include "plugin/registry.hpp"

namespace perikit::app {

/// Writes a project for a new part into the folder `part` (relative to the working folder): source, scene, CMakeLists.txt and README of
/// its kind's template; of a material with history where that is asked for. Returns what to do next. Throws InputError where the kind has no template, the name is none or taken, or
/// the folder exists.
std::string new_project(const Registry& registry, const std::string& kind, const std::string& part, bool history);

}  // namespace perikit::app
