#pragma once
#include <string>
#include <vector>

namespace perikit {

/// Where two resolved scenes differ, by key: "integrator.end_time: 1.0, now 2.0"; "damage.type: \"critical_stretch\", now not given".
std::vector<std::string> scene_differences(const std::string& before, const std::string& now);

}  // namespace perikit
