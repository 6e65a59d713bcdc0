#include "operations.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>

#include "perikit/core/errors.hpp"

namespace perikit::app {

namespace {
const std::string header = "kinematics,material,dimension,body,cells,operations";
}

std::string Operations::key(const std::string& kinematics, const std::string& material, const std::string& space, bool cloud, const std::string& cells) {
  return fmt::format("{},{},{},{},{}", kinematics, material, space, cloud ? "cloud" : "lattice", cells);
}

Operations::Operations(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::string line;
  if (!std::getline(stream, line) || line != header) throw InputError({file.string(), 1, 1}, "", fmt::format("found '{}'; allowed: the header {}", line, header));
  for (int number = 2; std::getline(stream, line); ++number) {
    const std::size_t comma = std::min(line.rfind(','), line.size());
    double value = NAN;
    const char* const end = line.data() + line.size();
    if (comma == line.size() || std::from_chars(line.data() + comma + 1, end, value).ptr != end || !(value >= 0)) {
      throw InputError({file.string(), number, 1}, "", fmt::format("found '{}'; allowed: {}", line, header));
    }
    counts_[line.substr(0, comma)] = value;
  }
}

double Operations::of(const std::string& key) const {
  const auto found = counts_.find(key);
  return found == counts_.end() ? NAN : found->second;
}

void Operations::write(const std::filesystem::path& file) const {
  Operations all = std::filesystem::exists(file) ? Operations(file) : Operations();
  for (const auto& [key, value] : counts_) all.counts_[key] = value;
  std::ofstream stream(file);
  stream << header << '\n';
  for (const auto& [key, value] : all.counts_) stream << fmt::format("{},{:.1f}\n", key, value);
  if (!stream.flush()) throw RunError(fmt::format("{}: cannot be written", file.string()));
}

}  // namespace perikit::app
