#pragma once
#include <vector>

#include "perikit/body/body.hpp"
#include "perikit/scene/scene.hpp"

namespace perikit {

/// Finds the points of each set. Throws InputError for sets without a point, and for points that do not exist or are listed
/// twice.
void add_sets(const std::vector<SetDescription>& sets, Body& body);

}  // namespace perikit
