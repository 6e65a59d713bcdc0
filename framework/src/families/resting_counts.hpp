#pragma once
#include <cstdint>

namespace perikit {

/// What was left out because no wave had arrived, over all evaluations of forces.
struct RestingCounts {
  std::int64_t blocks = 0;                    ///< of points, evaluated or left out
  std::int64_t quiet = 0;                     ///< left out
  RestingCounts& operator+=(const RestingCounts& other) noexcept {
    blocks += other.blocks;
    quiet += other.quiet;
    return *this;
  }
};

}  // namespace perikit
