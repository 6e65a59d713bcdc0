#pragma once
#include <toml++/toml.h>

#include "scene/diagnostics.hpp"

namespace perikit {

/// Applies "integrator.steps=20" or "boundary.0.displacement=[1, 0]" to a scene as parsed. The value is TOML, or else a string;
/// its position becomes the command line.
void apply_override(toml::table& root, const std::string& assignment, Diagnostics& errors);

}  // namespace perikit
