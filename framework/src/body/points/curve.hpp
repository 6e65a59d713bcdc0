#pragma once
/// The curve that orders the points of a cloud, and who owns which pieces of it.

#include <algorithm>
#include <cstdint>
#include <vector>

#include "perikit/body/body.hpp"

namespace perikit {

/// A Morton curve through cubes of one size.
class Curve {
 public:
  /// lower: the lowest coordinates of all points.
  Curve(const Point& lower, double cube) : lower_(lower), cube_(cube) {}

  /// Where the cube of a place comes: 63 bits.
  std::uint64_t key(const Point& x) const noexcept { return key(cube(x)); }
  /// Adds the keys of all cubes that a box meets.
  void add_keys(const Point& low, const Point& high, std::vector<std::uint64_t>& keys) const;

 private:
  using Cube = std::array<std::uint64_t, 3>;
  Cube cube(const Point& x) const noexcept {
    constexpr double last = 2097151;  // 21 bits an axis; what lies farther away is in the last cube
    Cube k{};
    for (std::size_t c = 0; c < 3; ++c) k[c] = static_cast<std::uint64_t>(std::clamp((x[c] - lower_[c]) / cube_, 0.0, last));
    return k;
  }
  static std::uint64_t key(const Cube& k) noexcept;

  Point lower_;
  double cube_;
};

/// Order of points along the curve; those of one cube keep the order that they have.
std::vector<std::int32_t> curve_order(const std::vector<Point>& positions, double cube);

/// Pieces of the curve: ranks own whole blocks of points, about as many each.
class CurveShares {
 public:
  CurveShares(std::int64_t points, int ranks)
      : points_(points),
        block_(static_cast<std::int64_t>(cloud_block_points(static_cast<std::size_t>(points)))),
        blocks_((points + block_ - 1) / block_),
        ranks_(static_cast<std::int64_t>(ranks)) {}

  std::int64_t points() const noexcept { return points_; }
  std::int64_t blocks() const noexcept { return blocks_; }
  /// Points of a block.
  std::int64_t block() const noexcept { return block_; }
  std::int64_t block_of(std::int64_t place) const noexcept { return place / block_; }
  int owner_of_block(std::int64_t b) const noexcept { return static_cast<int>(b * ranks_ / blocks_); }
  int owner(std::int64_t place) const noexcept { return owner_of_block(block_of(place)); }
  /// The first place of a rank; of the one after the last: how many there are.
  std::int64_t first(std::int64_t rank) const noexcept {
    return std::min(points_, block_ * ((rank * blocks_ + ranks_ - 1) / ranks_));
  }

 private:
  std::int64_t points_, block_, blocks_, ranks_;
};

}  // namespace perikit
