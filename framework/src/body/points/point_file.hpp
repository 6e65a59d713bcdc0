#pragma once
/// Points of a body from a file: CSV with a header line (x,y,z,volume), or HDF5 with datasets of these names.

#include <array>
#include <filesystem>
#include <vector>

namespace perikit {

struct PointCloud {
  std::vector<std::array<double, 3>> position;  ///< [m]; components beyond the dimension are 0
  std::vector<double> volume;                   ///< [m^3], > 0
};

/// Reads `file` (.h5 and .hdf5: HDF5, anything else: CSV). Columns may stand in any order; y and z may be missing in lower
/// dimensions. In CSV, '#' starts a comment and blank lines are skipped. Throws InputError with file, line, column and what was
/// found: not a number, nan or infinity, a volume that is not > 0, a component beyond the dimension that is not 0, a missing,
/// unknown or repeated column, a wrong number of cells, no points.
PointCloud read_points(const std::filesystem::path& file, int dimension);

}  // namespace perikit
