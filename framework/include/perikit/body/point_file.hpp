#pragma once
/// Point clouds from files.

#include <array>
#include <filesystem>
#include <vector>

namespace perikit {

struct PointCloud {
  std::vector<std::array<double, 3>> position;   ///< [m]; unused axes 0
  std::vector<double> volume;                    ///< [m^3]
};

/// CSV with a header line naming x, y, z, volume (axes beyond `dimension` optional), or .h5 with datasets of these names.
/// Throws InputError with file, line, column and what was found.
PointCloud read_points(const std::filesystem::path& file, int dimension);

}  // namespace perikit
