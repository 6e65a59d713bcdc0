/// Any bytes are a cloud of points and the frames of a run, or are refused with InputError.

#include <cmath>

#include "body/points/point_file.hpp"
#include "file.hpp"
#include "output/recorder.hpp"
#include "perikit/core/errors.hpp"

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  using namespace perikit;
  const std::filesystem::path file = input_file(data, size, ".h5");
  try {
    const PointCloud cloud = read_points(file, 3);
    if (cloud.position.empty() || cloud.position.size() != cloud.volume.size()) __builtin_trap();
    for (const double volume : cloud.volume)
      if (!(volume > 0) || !std::isfinite(volume)) __builtin_trap();
  } catch (const InputError&) {
  }
  try {
    const LoadedFrame frame = read_last_frame(file, 2);
    for (const auto& [name, field] : frame.fields)
      if (field.data.size() != 2 * static_cast<std::size_t>(field.width)) __builtin_trap();
  } catch (const InputError&) {
  }
  return 0;
}
