#include "output/result_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <system_error>

#include "perikit/core/errors.hpp"

namespace perikit {

namespace {

bool is_folder(const std::filesystem::path& path) {
  std::error_code no_access;
  return std::filesystem::is_directory(path, no_access);
}

std::filesystem::path results_h5(const std::filesystem::path& results) {
  return is_folder(results) ? results / "results.h5" : results;
}

}  // namespace

std::string frame_name(std::int64_t index) {
  return fmt::format("{:08}", index);
}

std::int64_t frame_index(const std::string& name) {
  const bool digits = name.size() == 8 && std::all_of(name.begin(), name.end(), [](char c) { return c >= '0' && c <= '9'; });
  return digits ? std::stoll(name) : -1;
}

std::filesystem::path results_folder(const std::filesystem::path& results) {
  return is_folder(results) ? results : results.parent_path();
}

ResultFile::ResultFile(const std::filesystem::path& results) : path_(results_h5(results)), source_(path_) {
  for (const std::string& name : source_.names("/frames")) {
    if (const std::int64_t index = frame_index(name); index >= 0) frames_.push_back(index);
  }
}

std::string ResultFile::frame_group(std::int64_t index) const {
  const auto refuse = [&](const std::string& message) { throw InputError({path_.string(), 0, 0}, "frame", message); };
  if (frames_.empty()) refuse("the run has written no frame yet");
  if (!std::binary_search(frames_.begin(), frames_.end(), index)) {
    refuse(fmt::format("found {}; must be one of {} ... {}", index, frames_.front(), frames_.back()));
  }
  const std::string group = "/frames/" + frame_name(index);
  if (!source_.contains(group)) refuse(fmt::format("frames/{}.h5 is missing or damaged", frame_name(index)));
  return group;
}

void ResultFile::each_point(std::span<const std::int64_t> numbers,
                            const std::function<void(std::size_t, std::span<const double>, double)>& use) const {
  for (const char* name : {"/reference/position", "/reference/volume"})
    if (!source_.contains(name))
      throw InputError({path_.string(), 0, 0}, name, "reference.h5 beside it is missing or damaged, so that nothing says of which body these results are");
  std::vector<double> volumes(numbers.size());
  source_.each_row("/reference/volume", numbers, [&](std::size_t k, std::span<const double> row) { volumes[k] = row[0]; });
  source_.each_row("/reference/position", numbers, [&](std::size_t k, std::span<const double> row) { use(k, row, volumes[k]); });
}

}  // namespace perikit
