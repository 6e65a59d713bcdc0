#pragma once
#include <cstddef>
#include <cstdint>
#include <string>

namespace perikit {

/// Where an evaluation met an inadmissible deformation, or a law whose step was too long.
struct EvaluationStatus {
  std::int64_t point = -1;   ///< input index of the point in the whole body, -1: all well
  std::size_t material = 0;  ///< number of its law
  std::string description;   ///< position, kinematics, material
  double step_factor = 1;    ///< below 1: a law asks for a step of at most this share of the length of the one that ended here
  bool ok() const noexcept { return point < 0; }
};

}  // namespace perikit
