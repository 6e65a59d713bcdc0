#pragma once
/// Differences and products of places and of vectors between them.

#include "perikit/body/body.hpp"

namespace perikit {

inline double dot(const Point& a, const Point& b) noexcept {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
inline Point operator-(const Point& a, const Point& b) noexcept {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

}  // namespace perikit
