// [[output.history]]: the columns of history.csv.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "output_fields/point_field.hpp"
#include "scene/scene_reader.hpp"
#include "scene/sections.hpp"
#include "scene/toml/toml_text.hpp"

namespace perikit {

namespace {

/// Keys that belong to some reductions alone, which need them.
const std::vector<std::pair<std::string, std::vector<std::string>>>& keys_of_reductions() {
  static const std::vector<std::pair<std::string, std::vector<std::string>>> keys{
      {"at", {"fit"}}, {"exact", {"error"}}, {"about", {"moment"}}, {"direction", {"extent", "tip"}}, {"above", {"extent", "tip"}}, {"piece", {"mass"}}};
  return keys;
}

/// The quantities that a reduction is made for; empty: all.
std::vector<std::string> quantities_of(const std::string& reduce) {
  if (reduce == "moment") return {"reaction", "internal_force", "external_force"};
  if (reduce == "area") return {"damage"};
  if (reduce == "mass") return {"fragment"};
  return {};
}

bool has(const std::vector<std::string>& names, const std::string& name) { return std::ranges::find(names, name) != names.end(); }

}  // namespace

const std::vector<std::string>& fixed_history_columns() {
  static const std::vector<std::string> columns{"step", "time", "time_step", "strain_energy", "kinetic_energy", "external_work", "dissipated_energy", "iterations",
                                                "residual", "dissipated_by_laws"};
  return columns;
}

void SceneReader::read_history(const toml::table& output) {
  const ParameterTable all = history_parameters(), derived = derived_column_parameters();
  std::vector<std::string> names = fixed_history_columns();
  std::vector<ParameterValues> columns;
  for (const toml::table* record : sections(output, "history", "output.history")) {
    const std::string path = fmt::format("output.history.{}", columns.size());
    const ParameterTable& table = record->contains("value") && !record->contains("quantity") ? derived : all;
    const ParameterValues& values = columns.emplace_back(reader_.read(*record, table, path));
    writer_.header("output.history", true);
    writer_.lines(table, values);
    HistoryDescription column;
    if (values.has("name")) {
      column.name = values.text("name");
      const auto refuse = [&](const std::string& message) { reader_.errors.add(values.position("name"), join_path(path, "name"), message); };
      const bool fits_csv = !column.name.empty() && std::ranges::none_of(column.name, [](unsigned char c) { return c < 0x20 || c == ',' || c == '"'; });
      if (!fits_csv)
        refuse(fmt::format("found {}; allowed: a column name without commas, quotes and control characters", toml_string(column.name)));
      else if (has(names, column.name))
        refuse(fmt::format("found \"{}\" again; allowed: names that no other column of history.csv has", column.name));
      names.push_back(column.name);
    }
    if (&table == &all) read_column(*record, values, column);
    scene_.output.history.push_back(std::move(column));
  }
  read_derived(columns);
}

/// A column of a quantity.
void SceneReader::read_column(const toml::table& record, const ParameterValues& values, HistoryDescription& column) {
  const ParameterTable table = history_parameters();
  const auto text = [&](const char* key) { return values.has(key) ? values.text(key) : std::string(); };
  const auto refuse = [&](const std::string& key, const std::string& message) {
    reader_.errors.add(values.position(key), join_path(values.path(), key), message);
  };
  column.set = set_of(values);
  column.quantity = text("quantity");
  column.component = text("component");
  column.reduce = text("reduce");
  column.position = values.position("quantity");
  const bool moment = column.reduce == "moment";
  if (values.has("quantity")) {
    check_state(column.quantity, column.position, join_path(values.path(), "quantity"));
    const int width = width_of(column.quantity);
    std::vector<std::string> components = field_components(width, reader_.dimension);
    if (moment) components = reader_.dimension == 2 ? std::vector<std::string>{"z"} : std::vector<std::string>{"x", "y", "z"};
    if (width > 0 && components.empty() && values.has("component")) {
      refuse("component", fmt::format("found \"{}\" of {}, which is a scalar; allowed: no component", column.component, column.quantity));
    } else if (moment && reader_.dimension == 2 && !record.contains("component")) {
      column.component = "z";
    } else if (!components.empty() && !has(components, column.component) && (values.has("component") || !record.contains("component"))) {
      refuse("component",
             fmt::format("found {}; allowed: {}", values.has("component") ? toml_string(column.component) : "nothing", fmt::join(components, ", ")));
    }
    if (const std::vector<std::string> quantities = quantities_of(column.reduce); !quantities.empty() && !has(quantities, column.quantity))
      refuse("reduce", fmt::format("found \"{}\" of {}; allowed: only of {}", column.reduce, column.quantity, fmt::join(quantities, ", ")));
  }
  if (moment && reader_.dimension == 1) refuse("reduce", "found \"moment\" in a body of one dimension; allowed: in bodies of two or three");
  for (const auto& [key, reductions] : keys_of_reductions()) {
    const bool belongs = has(reductions, column.reduce);
    if (values.has("reduce") && values.has(key) && !belongs)
      refuse(key, fmt::format("found it with reduce = \"{}\"; allowed: only with reduce = \"{}\"", column.reduce, fmt::join(reductions, "\" or \"")));
    else if (belongs && !record.contains(key))
      refuse("reduce", fmt::format("found \"{}\" without {}; allowed: {}", column.reduce, key, allowed(*table.find(key))));
  }
  if (values.has("at")) std::ranges::copy(values.numbers("at"), column.at.begin());
  if (values.has("about")) std::ranges::copy(values.numbers("about"), column.about.begin());
  if (values.has("above")) column.above = values.number("above");
  if (values.has("piece")) column.piece = values.integer("piece");
  if (values.has("exact"))
    column.exact.emplace(values.expression("exact"), scene_.constants, true, values.position("exact"), join_path(values.path(), "exact"));
  if (!values.has("direction")) return;
  std::ranges::copy(values.numbers("direction"), column.direction.begin());
  const double length = std::hypot(column.direction[0], column.direction[1], column.direction[2]);
  if (length == 0) refuse("direction", "found a direction of no length; allowed: numbers of which one at least is not 0");
  for (double& component : column.direction) component /= length;
}

/// The columns with a value from others, once all names are known, in an order in which they can be computed.
void SceneReader::read_derived(const std::vector<ParameterValues>& columns) {
  std::vector<HistoryDescription>& history = scene_.output.history;
  std::vector<std::string> names = fixed_history_columns();
  for (const HistoryDescription& column : history) names.push_back(column.name);
  const auto key = [&](std::size_t k) { return join_path(columns[k].path(), "value"); };
  std::vector<std::size_t> left;
  for (std::size_t k = 0; k < columns.size(); ++k) {
    if (!columns[k].has("value") || columns[k].has("quantity")) continue;
    try {
      history[k].value.emplace(columns[k].text("value"), names, scene_.constants, columns[k].position("value"), key(k));
      left.push_back(k);
    } catch (const InputError& error) {
      reader_.errors.add(columns[k].position("value"), error);
    }
  }
  // Of those that are left, the ones that use none that is left can be computed.
  const auto waits = [&](std::size_t k) {
    return std::ranges::any_of(left, [&](std::size_t other) { return has(history[k].value->columns(), history[other].name); });
  };
  while (!left.empty()) {
    const auto ready = std::ranges::find_if_not(left, waits);
    if (ready == left.end()) break;
    scene_.output.derived.push_back(*ready);
    left.erase(ready);
  }
  if (left.empty()) return;
  std::vector<std::string> circle;
  for (const std::size_t k : left) circle.push_back(history[k].name);
  reader_.errors.add(columns[left.front()].position("value"), key(left.front()),
                     fmt::format("found \"{}\" in a circle: {} cannot be computed, as each needs another of them or itself; allowed: columns that do not lead back",
                                 history[left.front()].name, fmt::join(circle, ", ")));
}

}  // namespace perikit
