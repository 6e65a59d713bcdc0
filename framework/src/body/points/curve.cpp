#include "body/points/curve.hpp"

#include <utility>

#include "perikit/core/parallel.hpp"

namespace perikit {

namespace {

/// Two zeros between the bits of a number of 21 bits.
std::uint64_t spread(std::uint64_t k) noexcept {
  k = (k | k << 32) & 0x001f00000000ffff;
  k = (k | k << 16) & 0x001f0000ff0000ff;
  k = (k | k << 8) & 0x100f00f00f00f00f;
  k = (k | k << 4) & 0x10c30c30c30c30c3;
  return (k | k << 2) & 0x1249249249249249;
}

}  // namespace

std::uint64_t Curve::key(const Cube& k) noexcept {
  return spread(k[0]) | spread(k[1]) << 1 | spread(k[2]) << 2;
}

void Curve::add_keys(const Point& low, const Point& high, std::vector<std::uint64_t>& keys) const {
  const Cube first = cube(low), last = cube(high);
  Cube k{};
  for (k[2] = first[2]; k[2] <= last[2]; ++k[2])
    for (k[1] = first[1]; k[1] <= last[1]; ++k[1])
      for (k[0] = first[0]; k[0] <= last[0]; ++k[0]) keys.push_back(key(k));
}

std::vector<std::int32_t> curve_order(const std::vector<Point>& positions, double cube) {
  Point lower = positions.front();
  for (const Point& x : positions)
    for (std::size_t c = 0; c < 3; ++c) lower[c] = std::min(lower[c], x[c]);
  const Curve curve(lower, cube);
  std::vector<std::pair<std::uint64_t, std::int32_t>> keys(positions.size());
  for (std::size_t p = 0; p < positions.size(); ++p) keys[p] = {curve.key(positions[p]), static_cast<std::int32_t>(p)};
  std::sort(keys.begin(), keys.end());
  std::vector<std::int32_t> order(positions.size());
  std::transform(keys.begin(), keys.end(), order.begin(), [](const auto& k) { return k.second; });
  return order;
}

}  // namespace perikit
