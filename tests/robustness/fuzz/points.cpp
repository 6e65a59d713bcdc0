/// Any text is a cloud of finite points with positive volumes, or is refused with InputError.

#include <cmath>

#include "body/points/point_file.hpp"
#include "file.hpp"
#include "perikit/core/errors.hpp"

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  using namespace perikit;
  const std::filesystem::path file = input_file(data, size, ".csv");
  for (const int dimension : {1, 3}) {
    try {
      const PointCloud cloud = read_points(file, dimension);
      if (cloud.position.empty() || cloud.position.size() != cloud.volume.size()) __builtin_trap();
      for (std::size_t p = 0; p < cloud.volume.size(); ++p) {
        if (!(cloud.volume[p] > 0) || !std::isfinite(cloud.volume[p])) __builtin_trap();
        for (const double x : cloud.position[p])
          if (!std::isfinite(x)) __builtin_trap();
      }
    } catch (const InputError&) {
    }
  }
  return 0;
}
