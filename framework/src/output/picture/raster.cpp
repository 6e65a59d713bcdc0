#include "output/picture/raster.hpp"

#include <algorithm>
#include <cmath>

namespace perikit {

void Raster::fill(const Eigen::Vector3d& centre, const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Colour& colour,
                  double dome) {
  const double determinant = a.x() * b.y() - a.y() * b.x();
  const double reach_x = std::abs(a.x()) + std::abs(b.x()), reach_y = std::abs(a.y()) + std::abs(b.y());
  if (!(std::abs(determinant) > 1e-9 * (reach_x * reach_y)) || !centre.allFinite()) return;  // seen edge on
  const auto clamped = [](double value, int limit) {
    return static_cast<int>(std::clamp(value, 0.0, static_cast<double>(limit)));
  };
  const int first_x = clamped(std::floor(centre.x() - reach_x), width_),
            last_x = clamped(std::ceil(centre.x() + reach_x), width_);
  const int first_y = clamped(std::floor(centre.y() - reach_y), height_),
            last_y = clamped(std::ceil(centre.y() + reach_y), height_);
  constexpr double edge = 1 + 1e-6;  // closes the seam between pieces that share an edge
  for (int row = first_y; row < last_y; ++row) {
    for (int column = first_x; column < last_x; ++column) {
      const double dx = column + 0.5 - centre.x(), dy = row + 0.5 - centre.y();
      const double s = (dx * b.y() - dy * b.x()) / determinant, t = (a.x() * dy - a.y() * dx) / determinant;
      if (std::abs(s) > edge || std::abs(t) > edge) continue;
      const std::size_t pixel =
          static_cast<std::size_t>(row) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(column);
      const float depth = static_cast<float>(centre.z() + s * a.z() + t * b.z() - dome * (s * s + t * t));
      if (depth <= depth_[pixel]) continue;
      depth_[pixel] = depth;
      colour_[pixel] = colour;
    }
  }
}

void Raster::disc(const Eigen::Vector3d& centre, double radius, const Colour& colour) {
  if (!centre.allFinite()) return;
  const auto first = [&](double at) { return static_cast<int>(std::max(0.0, std::floor(at - radius))); };
  const auto last = [&](double at, int limit) { return static_cast<int>(std::min<double>(limit, std::ceil(at + radius))); };
  for (int row = first(centre.y()); row < last(centre.y(), height_); ++row) {
    for (int column = first(centre.x()); column < last(centre.x(), width_); ++column) {
      if (std::hypot(column + 0.5 - centre.x(), row + 0.5 - centre.y()) > radius) continue;
      const std::size_t pixel = static_cast<std::size_t>(row) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(column);
      if (static_cast<float>(centre.z()) <= depth_[pixel]) continue;
      depth_[pixel] = static_cast<float>(centre.z());
      colour_[pixel] = colour;
    }
  }
}

std::vector<std::uint8_t> Raster::rgba(int factor) const {
  const int columns = width_ / factor, rows = height_ / factor;
  std::vector<std::uint8_t> bytes;
  bytes.reserve(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows) * 4);
  const auto byte = [](float value) { return static_cast<std::uint8_t>(std::lround(255 * std::clamp(value, 0.0f, 1.0f))); };
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      Colour sum = Colour::Zero();
      int covered = 0;
      for (int k = 0; k < factor * factor; ++k) {
        const std::size_t pixel = static_cast<std::size_t>(row * factor + k / factor) * static_cast<std::size_t>(width_) +
                                  static_cast<std::size_t>(column * factor + k % factor);
        if (!std::isfinite(depth_[pixel])) continue;
        sum += colour_[pixel];
        ++covered;
      }
      if (covered > 0) sum /= static_cast<float>(covered);
      for (int c = 0; c < 3; ++c) bytes.push_back(byte(sum[c]));
      bytes.push_back(byte(static_cast<float>(covered) / static_cast<float>(factor * factor)));
    }
  }
  return bytes;
}

}  // namespace perikit
