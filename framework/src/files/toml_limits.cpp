#include "files/toml_limits.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "perikit/core/errors.hpp"

namespace perikit {

namespace {

/// Where a string ends that begins at `at`: behind its closing quotes, or at the end of its line where it lacks them.
std::size_t end_of_string(std::string_view text, std::size_t at) {
  const char quote = text[at];
  const bool many_lines = text.substr(at, 3) == std::string(3, quote);
  const std::string closing(many_lines ? 3 : 1, quote);
  for (std::size_t i = at + closing.size(); i < text.size(); ++i) {
    if (quote == '"' && text[i] == '\\')
      ++i;
    else if (text.substr(i, closing.size()) == closing)
      return i + closing.size();
    else if (text[i] == '\n' && !many_lines)
      return i;
  }
  return text.size();
}

}  // namespace

void check_toml_limits(std::string_view text, const std::string& file, std::size_t largest) {
  if (text.size() > largest)
    throw InputError({file}, "", fmt::format("found {} bytes of TOML; allowed: at most {}", text.size(), largest));
  int line = 1, brackets = 0, names = 1;
  std::size_t line_begin = 0;
  for (std::size_t i = 0; i < text.size();) {
    const char c = text[i];
    if (c == '"' || c == '\'') {
      const std::size_t end = end_of_string(text, i);
      for (; i < end; ++i)
        if (text[i] == '\n') ++line, line_begin = i + 1;
      continue;
    }
    if (c == '#') {
      i = std::min(text.find('\n', i), text.size());
      continue;
    }
    if (c == '.') ++names;
    if (c == '[' || c == '{') ++brackets;
    if ((c == ']' || c == '}') && brackets > 0) --brackets;
    if (c == '\n' || c == '=' || c == ',' || c == '[' || c == '{') names = 1;
    if (names > deepest_toml || brackets > deepest_toml) {
      throw InputError({file, line, static_cast<int>(i - line_begin) + 1}, "",
                       fmt::format("found {}; allowed: at most {}",
                                   names > deepest_toml ? "a key of more names" : "more brackets in each other", deepest_toml));
    }
    if (c == '\n') ++line, line_begin = i + 1;
    ++i;
  }
}

}  // namespace perikit
