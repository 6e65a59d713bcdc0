#include "scene/toml/overrides.hpp"

#include <fmt/format.h>

#include <charconv>
#include <optional>
#include <utility>

#include "files/toml_limits.hpp"
#include "scene/toml/toml_text.hpp"

namespace perikit {

namespace {

/// { value = ... } parsed, so that the node carries the command line as its source.
std::optional<toml::table> parsed(const std::string& toml) {
  try {
    check_toml_limits(toml, std::string(command_line));
    toml::table table = toml::parse(std::string_view("value = " + toml), std::string_view(command_line));
    if (table.size() == 1 && table.contains("value")) return table;
  } catch (const toml::parse_error&) {
  }
  return std::nullopt;
}

/// Moves the node into `parent` (copies would lose positions).
void put(toml::node& parent, const std::string& key, std::size_t index, toml::node& value) {
  std::move(value).visit([&](auto&& node) {
    if (auto* table = parent.as_table()) {
      table->insert_or_assign(toml::key(key, value.source()), std::move(node));
    } else {
      parent.as_array()->replace(parent.as_array()->cbegin() + static_cast<std::ptrdiff_t>(index), std::move(node));
    }
  });
}

std::optional<std::size_t> index_in(const toml::array& array, const std::string& text) {
  std::size_t index = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), index);
  if (error != std::errc{} || end != text.data() + text.size() || index >= array.size()) return std::nullopt;
  return index;
}

std::vector<std::string> split(const std::string& path) {
  std::vector<std::string> keys(1);
  for (const char c : path) {
    if (c == '.')
      keys.emplace_back();
    else
      keys.back() += c;
  }
  return keys;
}

std::string trimmed(const std::string& text) {
  const auto begin = text.find_first_not_of(" \t");
  return begin == std::string::npos ? "" : text.substr(begin, text.find_last_not_of(" \t") - begin + 1);
}

}  // namespace

void apply_override(toml::table& root, const std::string& assignment, Diagnostics& errors) {
  const SourcePosition here{command_line, 0, 0};
  const auto equals = assignment.find('=');
  const std::string path = trimmed(assignment.substr(0, equals));
  if (equals == std::string::npos || path.empty()) {
    errors.add(here, "--set", fmt::format("found {}; allowed: key=value", toml_string(assignment)));
    return;
  }
  const std::string text = assignment.substr(equals + 1);
  const std::vector<std::string> keys = split(path);
  if (keys.size() > deepest_toml) {
    errors.add(here, "--set", fmt::format("found a key of {} names; allowed: at most {}", keys.size(), deepest_toml));
    return;
  }
  std::optional<toml::table> value = parsed(text);
  if (!value) value = parsed(toml_string(trimmed(text)));
  if (!value) {
    errors.add(here, path, "found text that is not UTF-8; allowed: a TOML value, or a string");
    return;
  }

  toml::node* parent = &root;
  std::string walked;
  for (std::size_t i = 0; i < keys.size(); ++i) {
    std::size_t index = 0;
    if (const auto* array = parent->as_array()) {
      const auto found = index_in(*array, keys[i]);
      if (!found) {
        errors.add(here, path,
                   fmt::format("found the index \"{}\" into {}; allowed: {}", keys[i], walked,
                               array->empty() ? "none, it is empty" : fmt::format("0 to {}", array->size() - 1)));
        return;
      }
      index = *found;
    }
    if (i + 1 == keys.size()) {
      put(*parent, keys[i], index, *value->get("value"));
      return;
    }
    auto child = [&] { return parent->is_table() ? parent->as_table()->get(keys[i]) : parent->as_array()->get(index); };
    if (!child() || !(child()->is_table() || child()->is_array())) {
      // A missing table is made; a part given by its name alone becomes { type = name }.
      const auto* name = child() ? child()->as_string() : nullptr;
      auto table = parsed(name ? "{ type = " + toml_string(name->get()) + " }" : "{}");
      put(*parent, keys[i], index, *table->get("value"));
    }
    parent = child();
    walked = join_path(walked, keys[i]);
  }
}

}  // namespace perikit
