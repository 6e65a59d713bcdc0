#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "perikit/body/body.hpp"
#include "perikit/scene/scene.hpp"

namespace perikit {

/// Internal indices by name, in the order of each set; of a part of a body with ghosts that belong to it.
using SetMembers = std::map<std::string, std::vector<std::int32_t>>;

/// What a set is true of; null for "all" and for sets of single points.
const Expression* set_expression(const Scene& scene, const std::string& name);

/// Finds the points of each set and gives the body its own ones. Throws InputError for sets without a point, and for points that
/// do not exist or are listed twice. All ranks must call it.
SetMembers add_sets(const std::vector<SetDescription>& sets, Body& body);

}  // namespace perikit
