#include <fmt/format.h>

#include <numeric>

#include "output/recorder.hpp"
#include "output/result_file.hpp"
#include "perikit/core/errors.hpp"

namespace perikit {

struct LastFrame::Implementation {
  explicit Implementation(const std::filesystem::path& results_h5)
      : results(results_h5), group(results.frame_group(results.frames().empty() ? 0 : results.frames().back())) {}
  ResultFile results;
  std::string group;
  double time = 0;
  std::int64_t step = 0;
  std::map<std::string, int> fields;
};

LastFrame::LastFrame(const std::filesystem::path& results_h5, std::size_t points)
    : implementation_(std::make_unique<Implementation>(results_h5)) {
  Implementation& self = *implementation_;
  const hdf5::Source& source = self.results.source();
  self.time = source.real(self.group, "time");
  self.step = source.integer(self.group, "step");
  for (const std::string& name : source.names(self.group, true)) {
    const std::vector<std::size_t> shape = source.shape(self.group + "/" + name);
    if (shape[0] != points) {
      throw InputError({self.results.path().string(), 0, 0}, self.group + "/" + name,
                       fmt::format("found {} points; this body has {}", shape[0], points));
    }
    self.fields[name] = shape.size() > 1 ? static_cast<int>(shape[1]) : 1;
  }
}

LastFrame::~LastFrame() = default;

double LastFrame::time() const noexcept {
  return implementation_->time;
}
std::int64_t LastFrame::step() const noexcept {
  return implementation_->step;
}
const std::map<std::string, int>& LastFrame::fields() const noexcept {
  return implementation_->fields;
}

void LastFrame::each_row(const std::string& field, std::span<const std::int64_t> numbers,
                         const std::function<void(std::size_t, std::span<const double>)>& use) const {
  implementation_->results.source().each_row(implementation_->group + "/" + field, numbers, use);
}

LoadedFrame read_last_frame(const std::filesystem::path& results_h5, std::size_t points) {
  const LastFrame last(results_h5, points);
  LoadedFrame frame{last.time(), last.step(), {}};
  std::vector<std::int64_t> all(points);
  std::iota(all.begin(), all.end(), std::int64_t{0});
  for (const auto& [name, width] : last.fields()) {
    OutputField& field = frame.fields[name] = OutputField{name, width, {}};
    field.data.reserve(points * static_cast<std::size_t>(width));
    last.each_row(name, all,
                  [&](std::size_t, std::span<const double> row) { field.data.insert(field.data.end(), row.begin(), row.end()); });
  }
  return frame;
}

}  // namespace perikit
