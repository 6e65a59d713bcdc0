#include "scene/scene_differences.hpp"

#include <fmt/format.h>

#include <map>
#include <sstream>
#include <toml++/toml.h>

#include "scene/scene_differences.hpp"
#include "scene/toml/toml_reader.hpp"
#include "scene/toml/toml_text.hpp"

namespace perikit {

namespace {

std::string shown(const toml::node& node) {
  if (const toml::array* array = node.as_array()) {
    std::string text;
    for (const toml::node& entry : *array) text += (text.empty() ? "" : ", ") + shown(entry);
    return "[" + text + "]";
  }
  if (const auto number = node.as_floating_point()) return toml_number(number->get());
  std::ostringstream text;
  node.visit([&](const auto& value) { text << value; });
  return text.str();
}

using Leaves = std::map<std::string, std::string>;

/// Every value by its dotted key; entries of an array of tables by their number.
void collect(const toml::node& node, const std::string& path, Leaves& leaves) {
  const auto below = [&](std::string_view key) { return path.empty() ? toml_key(key) : fmt::format("{}.{}", path, toml_key(key)); };
  if (const toml::table* table = node.as_table()) {
    for (const auto& [key, value] : *table) collect(value, below(key.str()), leaves);
  } else if (const toml::array* array = node.as_array(); array && !array->empty() && array->is_homogeneous<toml::table>()) {
    for (std::size_t k = 0; k < array->size(); ++k) collect(*array->get(k), below(fmt::format("{}", k)), leaves);
  } else {
    leaves[path] = excerpt(shown(node));
  }
}

Leaves leaves_of(const std::string& scene) {
  Leaves leaves;
  collect(parse_toml(scene, "scene.toml"), "", leaves);
  return leaves;
}

}  // namespace

std::vector<std::string> scene_differences(const std::string& before, const std::string& now) {
  const Leaves old_values = leaves_of(before), new_values = leaves_of(now);
  Leaves all = old_values;
  all.insert(new_values.begin(), new_values.end());
  std::vector<std::string> differences;
  for (const auto& [key, ignored] : all) {
    const auto a = old_values.find(key), b = new_values.find(key);
    const std::string from = a == old_values.end() ? "not given" : a->second, to = b == new_values.end() ? "not given" : b->second;
    if (from != to) differences.push_back(fmt::format("{}: {}, now {}", key, from, to));
  }
  // Texts that are told apart by something else than a value, or by the end of a long one.
  if (differences.empty() && before != now) differences.emplace_back("their texts");
  return differences;
}

}  // namespace perikit
