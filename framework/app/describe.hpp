#pragma once
#include <string>

#include "perikit/plugin/registry.hpp"

namespace perikit::app {

/// Known parts by kind, one line each. kind empty: all. Throws InputError for an unknown kind.
std::string list_parts(Registry& registry, const std::string& kind);

/// Everything that the part's tables say. `part`: KIND/NAME; or "scene", "scene/SECTION" for the keys of the scene itself.
std::string describe_part(Registry& registry, const std::string& part);

/// "exactly 2 of: youngs_modulus, ..."
std::string group_line(const ParameterGroup& group);

/// The keys of the scene and everything about every known part, as one Markdown page.
std::string reference_page(Registry& registry);

}  // namespace perikit::app
