#pragma once
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "perikit/body/body.hpp"
#include "scene/scene.hpp"

namespace perikit {

/// Internal indices by name, in the order of each set; of a part of a body with ghosts that belong to it.
using SetMembers = std::map<std::string, std::vector<std::int32_t>>;

/// What a set is true of; null for "all" and for sets of single points.
const Expression* set_expression(const Scene& scene, const std::string& name);

/// Shows points of a body, with numbers that ascend: ranks together show all of them, in input order one rank after the other.
using ShownPoints = std::function<void(const std::function<void(const Point& x, std::int64_t number)>& visit)>;

/// The points of a set that lists points or takes the nearest one, whichever rank shows them: the numbers that they are shown
/// with, ascending. All ranks must call it. Throws InputError as add_sets.
std::vector<std::int64_t> single_points(const SetDescription& description, const ShownPoints& points);

/// Throws InputError for a set that holds at no point.
[[noreturn]] void refuse_empty_set(const SetDescription& description);

/// Finds the points of each set and gives the body its own ones. Throws InputError for sets without a point, and for points that
/// do not exist or are listed twice. All ranks must call it.
SetMembers add_sets(const std::vector<SetDescription>& sets, Body& body);

}  // namespace perikit
