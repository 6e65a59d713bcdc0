#include "perikit/core/warnings.hpp"

namespace perikit {

std::string named(WarningName name, std::string_view text) {
  return std::string(text).append(" [").append(name.text()).append("]");
}

std::string_view warning_name(std::string_view warning) noexcept {
  const std::size_t begin = warning.rfind('[');
  if (begin == std::string_view::npos || !warning.ends_with(']')) return {};
  const std::string_view name = warning.substr(begin + 1, warning.size() - begin - 2);
  return std::ranges::find(warning_kinds, name) == warning_kinds.end() ? std::string_view() : name;
}

std::vector<std::string> without_silenced(std::vector<std::string> warnings, std::span<const std::string> silence) {
  std::erase_if(warnings, [&](const std::string& warning) { return std::ranges::find(silence, warning_name(warning)) != silence.end(); });
  return warnings;
}

}  // namespace perikit
