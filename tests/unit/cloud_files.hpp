#pragma once
/// Clouds of points for tests, and files of them.

#include <fmt/format.h>

#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include "body/points/point_file.hpp"
#include "files/hdf5_file.hpp"

namespace perikit::test {

/// Points at random places of a box, which are not far from being evenly spread.
inline PointCloud random_points(std::size_t count, const std::array<double, 3>& size, unsigned seed) {
  std::mt19937_64 random(seed);
  const auto number = [&] { return static_cast<double>(random() >> 11) * 0x1.0p-53; };
  PointCloud cloud;
  for (std::size_t n = 0; n < count; ++n) {
    cloud.position.push_back({size[0] * number(), size[1] * number(), size[2] * number()});
    cloud.volume.push_back(0.5 + number());
  }
  return cloud;
}

inline std::string csv(const PointCloud& cloud, int dimension) {
  std::string text =
      "\xEF\xBB\xBF# points\n\n" + std::string("volume,x,y,z").substr(0, 6 + 2 * static_cast<std::size_t>(dimension)) + "\r\n";
  for (std::size_t n = 0; n < cloud.volume.size(); ++n) {
    text += fmt::format("{}", cloud.volume[n]);
    for (std::size_t c = 0; c < static_cast<std::size_t>(dimension); ++c) text += fmt::format(", {}", cloud.position[n][c]);
    text += n % 7 == 0 ? "  # and so on, which is longer than other lines\r\n\n" : "\n";
  }
  text.pop_back();
  return text;
}

inline void write_hdf5(const std::filesystem::path& file, const PointCloud& cloud, int dimension) {
  hdf5::StoredFile out(file);
  out.dataset("volume", cloud.volume);
  for (std::size_t c = 0; c < static_cast<std::size_t>(dimension); ++c) {
    std::vector<double> values;
    for (const auto& x : cloud.position) values.push_back(x[c]);
    // Of any shape.
    out.dataset(std::string(1, "xyz"[c]), values, c == 1 ? 2 : 1);
  }
  out.keep();
}

inline std::string file_body(const std::filesystem::path& file) {
  return fmt::format("[body.points]\nfile = \"{}\"\n", file.string());
}

}  // namespace perikit::test
