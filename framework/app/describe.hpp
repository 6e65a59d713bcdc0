#pragma once
#include <string>

#include "perikit/plugin/registry.hpp"

namespace perikit::app {

/// Known parts by kind, one line each. kind empty: all. Throws InputError for an unknown kind.
std::string list_parts(Registry& registry, const std::string& kind);

/// Everything that the part's tables say. `part`: KIND/NAME.
std::string describe_part(Registry& registry, const std::string& part);

}  // namespace perikit::app
