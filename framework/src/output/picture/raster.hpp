#pragma once
/// Filled parallelograms with a depth buffer.

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <vector>

namespace perikit {

using Colour = Eigen::Vector3f;  ///< red, green, blue in 0 ... 1

class Raster {
 public:
  Raster(int width, int height)
      : width_(width),
        height_(height),
        depth_(size(), -std::numeric_limits<float>::infinity()),
        colour_(size(), Colour::Zero()) {}

  /// centre, a, b: x, y in pixels from the lower left corner, z towards the eye; the corners are centre +- a +- b. Where pieces
  /// overlap, the one nearer to the eye wins. `dome` > 0 lowers the edges of the piece by that much, so that among equals the
  /// nearest centre wins.
  void fill(const Eigen::Vector3d& centre, const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Colour& colour,
            double dome = 0);

  /// A disc towards the eye; x, y and radius in pixels.
  void disc(const Eigen::Vector3d& centre, double radius, const Colour& colour);

  /// Bytes red, green, blue, alpha, rows from below; blocks of `factor` x `factor` pixels are averaged.
  std::vector<std::uint8_t> rgba(int factor) const;

 private:
  std::size_t size() const { return static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_); }

  int width_, height_;
  std::vector<float> depth_;
  std::vector<Colour> colour_;
};

}  // namespace perikit
