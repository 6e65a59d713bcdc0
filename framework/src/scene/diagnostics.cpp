#include "scene/diagnostics.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>

namespace perikit {

void Diagnostics::add(SourcePosition position, std::string_view key, std::string_view message) {
  const InputError error(position, key, message);
  add(std::move(position), error);
}

void Diagnostics::add(SourcePosition position, const InputError& error) {
  entries_.push_back({std::move(position), error.what()});
}

void Diagnostics::raise() const {
  if (entries_.empty()) return;
  std::vector<Entry> sorted = entries_;
  const auto order = [](const Entry& e) {
    return std::tuple(e.position.file == command_line, e.position.line, e.position.column);
  };
  std::stable_sort(sorted.begin(), sorted.end(), [&](const Entry& a, const Entry& b) { return order(a) < order(b); });
  std::vector<std::string> messages;
  for (Entry& entry : sorted) messages.push_back(std::move(entry.text));
  throw InputErrors(std::move(messages));
}

std::string join_path(const std::string& path, std::string_view key) {
  return path.empty() ? std::string(key) : fmt::format("{}.{}", path, key);
}

}  // namespace perikit
