#pragma once
#include <cstdint>
#include <string>

namespace perikit {

/// Where an evaluation met an inadmissible deformation.
struct EvaluationStatus {
  std::int64_t point = -1;         ///< input index of the point, -1: all well
  std::string description;         ///< position, kinematics, material
  bool ok() const noexcept { return point < 0; }
};

}  // namespace perikit
