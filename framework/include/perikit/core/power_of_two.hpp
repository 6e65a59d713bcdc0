#pragma once
#include <algorithm>
#include <cmath>

namespace perikit {

/// The power of two that is next below `size` > 0; 1 for 0 and what is no finite number. A unit for sums of squares: what is divided by it keeps its
/// digits, and squares of the quotients stay within the range of numbers.
inline double power_of_two(double size) noexcept {
  return std::isfinite(size) && size > 0 ? std::ldexp(1.0, std::clamp(std::ilogb(size), -1000, 1000)) : 1.0;
}

}  // namespace perikit
