#include "scene/toml/toml_reader.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "files/toml_limits.hpp"
#include "scene/sections.hpp"
#include "scene/toml/toml_text.hpp"

namespace perikit {

std::string found(const toml::node& node) {
  if (const auto* v = node.as_string()) return "the string " + toml_string(excerpt(v->get()));
  if (const auto* v = node.as_integer()) return fmt::format("the integer {}", v->get());
  if (const auto* v = node.as_floating_point()) return fmt::format("the number {}", toml_number(v->get()));
  if (const auto* v = node.as_boolean()) return fmt::format("the boolean {}", v->get());
  if (node.is_table()) return "a table";
  if (const auto* v = node.as_array()) return fmt::format("a list of {}", v->size());
  return "a date or time";
}

toml::table parse_toml(const std::string& text, const std::string& file) {
  check_toml_limits(text, file);
  try {
    return toml::parse(std::string_view(text), std::string_view(file));
  } catch (const toml::parse_error& error) {
    const auto begin = error.source().begin;
    const bool bare_word = error.description().find("could not determine value type") != std::string_view::npos;
    throw InputError({file, static_cast<int>(begin.line), static_cast<int>(begin.column)}, "",
                     fmt::format("not valid TOML: {}{}", error.description(), bare_word ? "; texts and expressions stand in quotes, as in spacing = \"dx\"" : ""));
  }
}

ParameterTable part_table(const PartDescription& description, Kind kind, const std::string& path) {
  ParameterTable table = description.parameters;
  if (path != name(kind) && kind != Kind::term) return table;
  const ParameterTable common = common_part_parameters(kind);
  for (const Parameter& own : common.parameters()) {
    if (!table.find(own.name)) table.add(own.type, own.name, own.unit, own.text) = own;
  }
  return table;
}

SourcePosition TomlReader::position(const toml::source_region& source) const {
  if (default_position_) return *default_position_;
  if (source.path && *source.path == command_line) return {command_line, 0, 0};
  return {file_, std::max(1, static_cast<int>(source.begin.line)), std::max(1, static_cast<int>(source.begin.column))};
}

void TomlReader::check_keys(const toml::table& table, const std::string& path, const std::vector<std::string>& known) {
  for (const auto& [key, node] : table) {
    if (std::find(known.begin(), known.end(), key.str()) != known.end()) continue;
    const std::string allowed = known.empty() ? "no keys" : fmt::format("{}", fmt::join(known, ", "));
    errors.add(position(key.source()), join_path(path, key.str()),
               fmt::format("found an unknown key; allowed: {}{}", allowed, did_you_mean(key.str(), known)));
  }
}

ParameterValues TomlReader::read(const toml::table& table, const SourcePosition& at, const ParameterTable& parameters,
                                 const std::string& path, const std::vector<std::string>& others) {
  ParameterValues values;
  values.set_path(path);
  values.set_table_position(at);

  std::vector<std::string> known = others, unused;
  for (const Parameter& parameter : parameters.parameters()) known.push_back(parameter.name);
  check_keys(table, path, known);
  for (const ParameterGroup& group : parameters.groups()) {
    for (std::string& name : check_group(group, parameters, table, at, path)) unused.push_back(std::move(name));
  }
  for (const Parameter& parameter : parameters.parameters()) {
    const std::string key = join_path(path, parameter.name);
    if (const toml::node* node = table.get(parameter.name)) {
      if (auto read = value(parameter, *node, key)) {
        values.set(parameter.name, std::move(*read), position(*node));
        if (parameter.type == ParameterType::expression && node->is_string()) values.mark_expression(parameter.name);
      }
    } else if (parameter.required) {
      errors.add(at, key, fmt::format("found nothing; allowed: {}", allowed(parameter)));
    } else if (!parameter.default_text.empty() && std::find(unused.begin(), unused.end(), parameter.name) == unused.end()) {
      const toml::table parsed = parse_toml("value = " + parameter.default_text, "default of " + key);
      const auto outer = std::exchange(default_position_, default_position_.value_or(at));
      if (auto read = value(parameter, *parsed.get("value"), key)) values.set(parameter.name, std::move(*read), at, false);
      default_position_ = outer;
    }
  }
  return values;
}

std::vector<std::string> TomlReader::check_group(const ParameterGroup& group, const ParameterTable& parameters,
                                                 const toml::table& table, const SourcePosition& at, const std::string& path) {
  const auto limit = static_cast<std::size_t>(std::abs(group.count));
  std::vector<std::string> given, without_room;
  for (const std::string& name : group.names) {
    if (table.contains(name)) given.push_back(name);
  }
  std::size_t used = given.size();
  for (const std::string& name : group.names) {
    const Parameter* parameter = parameters.find(name);
    if (table.contains(name) || !parameter || parameter->default_text.empty()) continue;
    if (used < limit)
      ++used;
    else
      without_room.push_back(name);
  }
  if (used > limit || (group.count > 0 && used < limit)) {
    const std::string what =
        given.empty() ? "none of them" : fmt::format("{}{}", fmt::join(given, ", "), used < limit ? " only" : "");
    errors.add(at, path,
               fmt::format("found {}; allowed: {} {} of {}", what, group.count > 0 ? "exactly" : "at most", limit,
                           fmt::join(group.names, ", ")));
  }
  return without_room;
}

std::shared_ptr<const PartValues> TomlReader::part(Kind kind, const toml::node& node, const std::string& path) {
  const std::string names = fmt::format("{}", fmt::join(parts_.names(kind), ", "));
  if (const auto* type = node.as_string()) return part(kind, type->get(), {}, path, path, position(node));
  const toml::table* table = node.as_table();
  if (!table) {
    Parameter part_parameter;
    part_parameter.type = ParameterType::part;
    part_parameter.kind = kind;
    refuse(node, path, fmt::format("found {}; allowed: {}; known: {}", found(node), allowed(part_parameter), names));
    return nullptr;
  }
  const toml::node* type = table->get("type");
  if (!type || !type->is_string()) {
    refuse(type ? *type : node, join_path(path, "type"),
           fmt::format("found {}; allowed: the name of one; known: {}", type ? found(*type) : "nothing", names));
    return nullptr;
  }
  return part(kind, type->as_string()->get(), *table, path, join_path(path, "type"), position(*type));
}

std::shared_ptr<const PartValues> TomlReader::part(Kind kind, const std::string& type, const toml::table& table,
                                                   const std::string& path, const std::string& type_path,
                                                   const SourcePosition& at) {
  const PartDescription* description = nullptr;
  try {
    description = &parts_.describe(kind, type);
  } catch (const std::exception& error) {
    errors.add(at, type_path, error.what());
    return nullptr;
  }
  auto values = std::make_shared<PartValues>();
  values->kind = kind;
  values->type = type;
  values->values = read(table, table.empty() ? at : position(table), part_table(*description, kind, path), path, {"type"});
  values->values.set("type", type, at);  // no parameter, but a place that refusals of the part itself point at
  return values;
}

}  // namespace perikit
