#pragma once
/// The gradients of both ends in a bond's A = (1 - s) Hbar_i + s Hbar_j. A point whose bonds lie on a line (in space: in a plane) has no gradient: its shape
/// tensor is singular, and its Hbar = 0 would not turn with the body, so that a rotation alone would store energy. Its share falls to the other end. A
/// bond whose ends have no gradient to give stores no energy, as a point without a gradient stores none.

#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "families/families.hpp"

namespace perikit {

struct EndShares {
  double near, far;
  bool none() const noexcept { return near == 0 && far == 0; }
};

/// far_share: s. Whether the ends have a gradient.
inline EndShares end_shares(double far_share, bool near_has, bool far_has) noexcept {
  if (near_has && far_has) return {1 - far_share, far_share};
  return {near_has && far_share < 1 ? 1.0 : 0.0, far_has && far_share > 0 ? 1.0 : 0.0};
}

inline bool has_gradient(const Families& families, std::size_t p) noexcept { return std::isfinite(families.condition(p)); }

inline EndShares end_shares(const Families& families, double far_share, std::size_t near, std::size_t far) noexcept {
  return end_shares(far_share, has_gradient(families, near), has_gradient(families, far));
}

/// Which points have no gradient now, for loops over bonds.
class PointsWithoutGradient {
 public:
  explicit PointsWithoutGradient(const Families& families) : families_(families), without_(families.body().stride(), 0) {
    for (const std::int32_t p : families.body().internal()) renew(p);
  }
  /// The bonds of these points have changed.
  void renew(std::span<const std::int32_t> points) {
    for (const std::int32_t p : points) renew(p);
  }
  bool any() const noexcept { return count_ > 0; }
  bool operator[](std::size_t p) const noexcept { return without_[p] != 0; }
  std::size_t bytes() const noexcept { return without_.size(); }

 private:
  void renew(std::int32_t point) {
    const auto p = static_cast<std::size_t>(point);
    count_ -= without_[p];
    without_[p] = has_gradient(families_, p) ? 0 : 1;
    count_ += without_[p];
  }

  const Families& families_;
  std::vector<std::uint8_t> without_;
  std::size_t count_ = 0;
};

}  // namespace perikit
