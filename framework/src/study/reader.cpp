// The study file: keys, lists of values, quantities, plot.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <set>
#include <sstream>
#include <tuple>

#include "files/toml_limits.hpp"
#include "scene/toml/toml_reader.hpp"
#include "scene/toml/toml_text.hpp"
#include "study/study.hpp"

namespace perikit {

namespace fs = std::filesystem;

namespace {

ParameterTable head_table() {
  ParameterTable table;
  table.integer("format", "Version of the study vocabulary.").require().at_least(1).at_most(1);
  table.string("title", "Stands above the table and the picture.").by_default("\"\"");
  table.string("scene", "The scene that is varied, relative to the study file.").require();
  table.choice("mode", {"grid", "zip"}, "Every combination of the values, or the lists side by side.").by_default("\"grid\"");
  return table;
}

ParameterTable quantity_table() {
  ParameterTable table;
  table.string("name", "Name of its column.").require();
  table.string("from", fmt::format("A column of history.csv, or a measure of the run: {}.", fmt::join(run_measures(), ", "))).require();
  table.choice("reduce", {"last", "max", "min", "mean"}, "How the rows of the history become one number.").by_default("\"last\"");
  return table;
}

ParameterTable plot_table() {
  ParameterTable table;
  table.string("x", "Column of the horizontal axis.").require();
  table.string("y", "Column of the vertical axis.").require();
  table.string("series", "A line for each value of this key; of several, separated by commas, for each combination of their values. Over a key, all other keys "
                         "that have several values are added (mode = \"grid\").");
  table.choice("log", {"", "x", "y", "xy"}, "Axes with a logarithmic scale.").by_default("\"\"");
  table.number("level", "-", "A value of y: a line in the picture, and a table of where each series stays below it.");
  return table;
}

/// One line of TOML; nothing for dates and times, which no scene knows.
std::optional<std::string> one_line(const toml::node& node) {
  if (const auto* v = node.as_string()) return toml_string(v->get());
  if (const auto* v = node.as_integer()) return fmt::format("{}", v->get());
  if (const auto* v = node.as_floating_point()) return toml_number(v->get());
  if (const auto* v = node.as_boolean()) return fmt::format("{}", v->get());
  std::vector<std::string> parts;
  const auto add = [&](const toml::node& element, const std::string& prefix) {
    const auto text = one_line(element);
    if (text) parts.push_back(prefix + *text);
    return text.has_value();
  };
  if (const auto* array = node.as_array()) {
    for (const toml::node& element : *array) {
      if (!add(element, "")) return std::nullopt;
    }
    return fmt::format("[{}]", fmt::join(parts, ", "));
  }
  if (const auto* table = node.as_table()) {
    for (const auto& [key, element] : *table) {
      if (!add(element, toml_key(key.str()) + " = ")) return std::nullopt;
    }
    return fmt::format("{{ {} }}", fmt::join(parts, ", "));
  }
  return std::nullopt;
}

class StudyReader {
 public:
  StudyReader(PartCatalogue& parts, const fs::path& file) : reader_(parts, file.string()) { study_.file = file; }

  Study read(const toml::table& root) {
    if (const auto body = root.find("body"); body != root.end() && !root.contains("scene"))
      throw InputError(reader_.position(body->first.source()), "body",
                       fmt::format("found a scene: `perikit run {} -o DIR` runs it; allowed here: a study, which names a scene and lists values for its keys", study_.file.string()));
    read_head(root);
    read_values(root);
    read_quantities(root);
    read_plot(root);
    reader_.errors.raise();
    return std::move(study_);
  }

 private:
  void read_head(const toml::table& root) {
    const ParameterValues values = reader_.read(root, head_table(), "", {"values", "quantity", "plot"});
    if (values.has("title")) study_.title = values.text("title");
    if (values.has("mode")) study_.zip = values.text("mode") == "zip";
    if (!values.has("scene")) return;
    study_.scene = (study_.file.parent_path() / values.text("scene")).lexically_normal();
    if (std::error_code failed; !fs::is_regular_file(study_.scene, failed)) {
      reader_.errors.add(values.position("scene"), "scene",
                         fmt::format("found {}, but {} is no file; allowed: a scene file, relative to the study",
                                     toml_string(values.text("scene")), study_.scene.string()));
    }
  }

  void read_values(const toml::table& root) {
    const toml::node* node = root.get("values");
    if (!node || !node->is_table() || node->as_table()->empty()) {
      reader_.errors.add(
          reader_.position(node ? *node : root), "values",
          fmt::format("found {}; allowed: a table of scene keys with lists of values", !node              ? "nothing"
                                                                                       : node->is_table() ? "an empty table"
                                                                                                          : found(*node)));
      return;
    }
    read_keys(*node->as_table(), "");
    const auto place = [](const StudyKey& key) { return std::tuple(key.position.line, key.position.column); };
    std::ranges::sort(study_.keys, {}, place);  // TOML tables forget their order
    if (study_.keys.empty()) return;
    if (!study_.zip) return count_combinations(reader_.position(*node));
    const StudyKey& first = study_.keys.front();
    for (const StudyKey& key : study_.keys) {
      if (key.values.size() == first.values.size()) continue;
      reader_.errors.add(key.position, "values." + key.key,
                         fmt::format("found a list of {}; allowed with mode = \"zip\": {}, as many as {} has", key.values.size(),
                                     first.values.size(), first.key));
    }
  }

  /// All combinations are made, and their scenes read, before the first run.
  void count_combinations(const SourcePosition& position) {
    constexpr double most = 1e6;
    double count = 1;
    for (const StudyKey& key : study_.keys) count *= static_cast<double>(key.values.size());
    if (count <= most) return;
    reader_.errors.add(position, "values", fmt::format("found {:.3g} combinations; allowed: at most {:.0f} runs, several studies for more", count, most));
  }

  /// kinematics.type = [...] is a table in a table; "kinematics.type" = [...] is not: both mean the same.
  void read_keys(const toml::table& table, const std::string& path) {
    for (const auto& [name, node] : table) {
      const std::string key = join_path(path, name.str()), full = "values." + key;
      if (const auto* inner = node.as_table()) {
        read_keys(*inner, key);
        continue;
      }
      const toml::array* list = node.as_array();
      if (!list || list->empty()) {
        reader_.refuse(node, full, fmt::format("found {}; allowed: a list of values, at least one", found(node)));
        continue;
      }
      if (std::ranges::find(study_.keys, key, &StudyKey::key) != study_.keys.end()) {
        reader_.refuse(node, full, "found the key twice; allowed: once");
        continue;
      }
      StudyKey& entry = study_.keys.emplace_back(StudyKey{key, {}, reader_.position(node)});
      for (const toml::node& value : *list) read_value(entry, value, fmt::format("{}.{}", full, entry.values.size()));
    }
  }

  void read_value(StudyKey& key, const toml::node& node, const std::string& path) {
    const auto text = one_line(node);
    if (!text)
      reader_.refuse(node, path, fmt::format("found {}; allowed: a number, boolean, string, list or table", found(node)));
    StudyValue value{text.value_or(""), shown(node, text.value_or("")), std::nullopt};
    if (node.is_number()) value.number = node.value<double>();
    key.values.push_back(std::move(value));
  }

  /// A string without its quotes; a table by its type, then what else it says, tables in it without their keys: conventional (wan),
  /// conventional (silling (coefficient = 0.1)).
  static std::string shown(const toml::node& node, const std::string& text) {
    if (const auto* string = node.as_string()) return string->get();
    const auto* table = node.as_table();
    if (!table) return text;
    std::string type, rest;
    for (const auto& [key, value] : *table) {
      const std::string inner = shown(value, one_line(value).value_or(""));
      if (key == "type")
        type = inner;
      else
        rest += (rest.empty() ? "" : ", ") + (value.is_table() ? inner : std::string(key.str()) + " = " + inner);
    }
    if (type.empty()) return rest;
    return rest.empty() ? type : type + " (" + rest + ")";
  }

  void read_quantities(const toml::table& root) {
    const toml::node* node = root.get("quantity");
    const toml::array* list = node ? node->as_array() : nullptr;
    if (!list || list->empty() || !list->is_homogeneous<toml::table>()) {
      reader_.errors.add(
          reader_.position(node ? *node : root), "quantity",
          fmt::format("found {}; allowed: [[quantity]], a list of tables, at least one", node ? found(*node) : "nothing"));
      return;
    }
    std::set<std::string> taken{"run", "status", "reason"};
    for (const StudyKey& key : study_.keys) taken.insert(key.key);
    for (const toml::node& entry : *list) read_quantity(*entry.as_table(), taken);
  }

  void read_quantity(const toml::table& table, std::set<std::string>& taken) {
    StudyQuantity quantity;
    quantity.path = fmt::format("quantity.{}", study_.quantities.size());
    const ParameterValues values = reader_.read(table, quantity_table(), quantity.path, {"reference"});
    if (values.has("name")) {
      quantity.name = values.text("name");
      if (quantity.name.empty() || !taken.insert(quantity.name).second || !taken.insert(quantity.error_column()).second) {
        reader_.errors.add(values.position("name"), quantity.path + ".name",
                           fmt::format("found {}; allowed: a name of its own, other than {}", toml_string(quantity.name),
                                       fmt::join(taken, ", ")));
      }
    }
    if (values.has("from")) quantity.from = values.text("from");
    if (values.has("reduce")) quantity.reduce = values.text("reduce");
    quantity.from_position = values.position("from");
    if (const toml::node* reference = table.get("reference")) {
      quantity.reference_position = reader_.position(*reference);
      const auto number = reference->is_number() ? reference->value<double>() : std::nullopt;
      if (reference->is_string()) {
        quantity.reference = reference->as_string()->get();
      } else if (number && std::isfinite(*number) && *number != 0) {
        quantity.reference = *number;
      } else {
        reader_.refuse(*reference, quantity.path + ".reference",
                       fmt::format("found {}; allowed: a number other than zero, or an expression in the constants of the scene",
                                   found(*reference)));
      }
    }
    study_.quantities.push_back(std::move(quantity));
  }

  void read_plot(const toml::table& root) {
    const toml::node* node = root.get("plot");
    if (!node) return;
    if (!node->is_table()) {
      reader_.refuse(*node, "plot", fmt::format("found {}; allowed: a table [plot]", found(*node)));
      return;
    }
    const ParameterValues values = reader_.read(*node->as_table(), plot_table(), "plot");
    std::vector<std::string> keys, columns;
    for (const StudyKey& key : study_.keys) keys.push_back(key.key);
    columns = keys;
    for (const StudyQuantity& quantity : study_.quantities) {
      columns.push_back(quantity.name);
      if (quantity.reference) columns.push_back(quantity.error_column());
    }
    const auto check = [&](const char* key, const std::string& text, const std::vector<std::string>& known) {
      if (std::ranges::find(known, text) == known.end()) {
        reader_.errors.add(
            values.position(key), join_path("plot", key),
            fmt::format("found {}; allowed: {}{}", toml_string(text), fmt::join(known, ", "), did_you_mean(text, known)));
      }
      return text;
    };
    const auto name = [&](const char* key, const std::vector<std::string>& known) { return values.has(key) ? check(key, values.text(key), known) : ""; };
    std::vector<std::string> series;
    std::istringstream list(values.has("series") ? values.text("series") : "");
    for (std::string key; std::getline(list, key, ',');) {
      key.erase(0, std::min(key.find_first_not_of(' '), key.size()));
      key.erase(key.find_last_not_of(' ') + 1);
      series.push_back(check("series", key, keys));
    }
    study_.plot =
        StudyPlot{name("x", columns), name("y", columns), series, values.has("log") ? values.text("log") : "",
                            values.has("level") ? std::optional(values.number("level")) : std::nullopt};
    if (study_.plot->level && study_.plot->log.find('y') != std::string::npos && !(*study_.plot->level > 0)) {
      reader_.errors.add(values.position("level"), "plot.level", fmt::format("found {}; allowed with a logarithmic axis: a number > 0", *study_.plot->level));
    }
  }

  TomlReader reader_;
  Study study_;
};

/// What read_quantity reads by itself, as describe shows it.
ParameterTable whole_quantity_table() {
  ParameterTable table = quantity_table();
  table.expression("reference", "", "Gives the column NAME_error, the distance from it over its size; an expression in the scene's [constants]; not 0.");
  return table;
}

}  // namespace

const std::vector<std::pair<std::string, ParameterTable>>& study_sections() {
  static const std::vector<std::pair<std::string, ParameterTable>> all{{"", head_table()}, {"quantity", whole_quantity_table()}, {"plot", plot_table()}};
  return all;
}

Study parse_study(const std::string& text, const fs::path& file, PartCatalogue& parts) {
  return StudyReader(parts, file).read(parse_toml(text, file.string()));
}

Study read_study(const fs::path& file, PartCatalogue& parts) {
  std::error_code failed;
  if (!fs::exists(file, failed)) throw InputError({file.string()}, "", "does not exist; allowed: a readable study file");
  std::ifstream stream(file, std::ios::binary);
  if (!fs::is_regular_file(file, failed) || !stream)
    throw InputError({file.string()}, "", "cannot be read; allowed: a readable study file");
  if (const auto size = fs::file_size(file, failed); !failed && size > largest_toml)
    throw InputError({file.string()}, "", fmt::format("has {} bytes; allowed: at most {}", size, largest_toml));
  return parse_study({std::istreambuf_iterator<char>(stream), {}}, file, parts);
}

}  // namespace perikit
