#include <fmt/format.h>

#include "output/result_file.hpp"
#include "perikit/core/errors.hpp"
#include "perikit/output/recorder.hpp"

namespace perikit {

LoadedFrame read_last_frame(const std::filesystem::path& results_h5, std::size_t points) {
  const ResultFile results(results_h5);
  const std::string group = results.frame_group(results.frames().empty() ? 0 : results.frames().back());
  const hdf5::Source& source = results.source();
  LoadedFrame frame{source.real(group, "time"), source.integer(group, "step"), {}};
  for (const std::string& name : source.names(group, true)) {
    hdf5::Source::Array array = source.read(group + "/" + name);
    if (array.rows() != points) {
      throw InputError({results.path().string(), 0, 0}, group + "/" + name,
                       fmt::format("found {} points; this body has {}", array.rows(), points));
    }
    frame.fields[name] = OutputField{name, array.width(), std::move(array.data)};
  }
  return frame;
}

}  // namespace perikit
