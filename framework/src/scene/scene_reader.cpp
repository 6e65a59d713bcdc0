#include "scene/scene_reader.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>

#include "fracture/failure_energy.hpp"
#include "model/formulation.hpp"
#include "perikit/core/warnings.hpp"
#include "scene/expressions/expression_names.hpp"
#include "scene/sections.hpp"
#include "scene/toml/toml_text.hpp"

namespace perikit {

namespace {

const std::vector<std::string> section_names{"constants", "body",     "sets",      "family",     "kinematics", "material",
                                             "region",    "damage",   "interface", "crack",      "initial",    "boundary",
                                             "symmetry",  "periodic", "load",      "term",       "integrator", "output",     "run"};

bool identifier(std::string_view name) {
  return !name.empty() && !std::isdigit(static_cast<unsigned char>(name[0])) &&
         std::all_of(name.begin(), name.end(), [](unsigned char c) { return (c < 0x80 && std::isalnum(c)) || c == '_'; });
}

/// The scene of a study is another file: nothing else of it needs a message.
void refuse_study(const toml::table& root, const std::filesystem::path& file, const TomlReader& reader) {
  const auto scene = root.find("scene");
  if (scene == root.end() || root.contains("body") || !(root.contains("values") || root.contains("quantity"))) return;
  const std::string name = scene->second.value_or(std::string());
  throw InputError(reader.position(scene->first.source()), "scene",
                   fmt::format("found a study, which runs a scene over lists of values: `perikit study {} -o DIR` runs it; allowed here: a scene{}", file.string(),
                               name.empty() ? "" : ", such as " + (file.parent_path() / name).lexically_normal().string()));
}

}  // namespace

SceneReader::SceneReader(PartCatalogue& parts, const std::filesystem::path& file, bool trust)
    : parts_(parts), reader_(parts, file.string()), writer_(parts), trust_(trust) {
  scene_.file = file;
}

void SceneReader::read(toml::table& root) {
  refuse_study(root, scene_.file, reader_);
  refuse_reserved(root);
  read_head(root);
  read_constants(root);
  read_body(root);
  read_sets(root);
  read_family(root);
  read_parts(root);
  read_regions(root);
  read_interfaces(root);
  read_cracks(root);
  read_initial(root);
  read_boundaries(root);
  read_planes(root);
  read_loads(root);
  read_terms(root);
  read_output(root);
  read_run(root);
  find_unused_constants(root);
}

/// Names in all texts below a node, those of keys left out.
void SceneReader::names_below(const toml::node& node, std::set<std::string>& names) {
  if (const auto* text = node.as_string())
    for (std::string& name : names_of_expression(text->get())) names.insert(std::move(name));
  if (const auto* array = node.as_array())
    for (const toml::node& element : *array) names_below(element, names);
  if (const auto* table = node.as_table())
    for (const auto& [key, value] : *table) names_below(value, names);
}

/// A constant that nothing uses was often meant to be used where its value stands.
void SceneReader::find_unused_constants(const toml::table& root) {
  std::set<std::string> names;
  names_below(root, names);
  for (const auto& [name, value] : scene_.constants) {
    if (names.contains(name)) continue;
    const toml::node* node = root["constants"][name].node();
    const int line = node ? reader_.position(*node).line : 0;
    scene_.warnings.push_back(named("unused_constant", fmt::format("constants.{}{} is not used in the scene", name, line > 0 ? fmt::format(" (line {})", line) : "")));
  }
}

Scene SceneReader::take() {
  scene_.resolved = writer_.text();
  return std::move(scene_);
}

void SceneReader::refuse_reserved(toml::table& root) {
  const auto refuse = [&](toml::table& table, const std::string& key, const std::string& path) {
    const toml::node& node = *table.get(key);
    reader_.refuse(node, path, fmt::format("found {}; the word \"{}\" is reserved for a later version", found(node), key));
    table.erase(key);
  };
  for (const char* word : {"contact", "stage"}) {
    if (root.contains(word)) refuse(root, word, word);
  }
  if (auto* bodies = root["body"].as_array()) {
    reader_.refuse(*bodies, "body",
                   "found a list of bodies; [[body]] is reserved for a later version; allowed: one table [body]");
  }
  if (auto* regions = root["region"].as_array()) {
    for (std::size_t i = 0; i < regions->size(); ++i) {
      auto* region = regions->get(i)->as_table();
      if (region && region->contains("damage")) refuse(*region, "damage", fmt::format("region.{}.damage", i));
    }
  }
}

void SceneReader::read_head(const toml::table& root) {
  const ParameterTable table = head_parameters();
  ParameterValues values = reader_.read(root, table, "", section_names);
  if (values.has("title")) scene_.title = values.text("title");
  if (values.has("plugins") && !values.texts("plugins").empty()) {
    if (!trust_) {
      reader_.errors.add(values.position("plugins"), "plugins",
                         fmt::format("found {} to open; libraries that a scene lists are opened only with --trust",
                                     fmt::join(values.texts("plugins"), ", ")));
    }
    std::vector<std::string> files;
    for (const std::string& name : values.texts("plugins")) {
      if (name.empty() || name.find('\0') != std::string::npos) {
        reader_.errors.add(values.position("plugins"), "plugins", "found an empty name; allowed: files of libraries (.so)");
        continue;
      }
      const std::filesystem::path file = from_scene_folder(name);
      files.push_back(file.string());
      try {
        if (trust_) parts_.open(file);
      } catch (const std::exception& error) {
        reader_.errors.add(values.position("plugins"), "plugins", error.what());
      }
    }
    values.set("plugins", files, values.position("plugins"));
  }
  writer_.lines(table, values);
}

/// A number, or an expression in constants that are known already. What is wrong counts as 0, so that its uses are not reported as
/// well.
double SceneReader::constant(const std::string& name, const toml::node& node) {
  const std::string path = join_path("constants", name);
  const std::optional<std::string> text = node.value<std::string>();
  if (!text) {
    const auto value = reader_.value(Parameter{}, node, path);
    return value ? std::get<double>(*value) : 0.0;
  }
  try {
    const Expression expression(*text, scene_.constants, false, reader_.position(node), path);
    if (!expression.depends_on_position()) return expression({});
    reader_.errors.add(
        reader_.position(node), path,
        fmt::format("found {}, which depends on the position; allowed: numbers, and expressions in other constants",
                    toml_string(*text)));
  } catch (const InputError& error) {
    reader_.errors.add(reader_.position(node), error);
  }
  return 0.0;
}

void SceneReader::read_constants(const toml::table& root) {
  const toml::table* constants = section(root, "constants", "constants");
  if (!constants || constants->empty()) return;
  const std::vector<std::string> taken = expression_words();
  std::vector<std::pair<std::string, const toml::node*>> waiting;  // a constant may use others, wherever they stand
  for (const auto& [key, node] : *constants) {
    const std::string name(key.str()), path = join_path("constants", name);
    if (!identifier(name)) {
      reader_.errors.add(
          reader_.position(key.source()), path,
          fmt::format("found the name {}; allowed: letters, digits and _, not starting with a digit", toml_string(name)));
    } else if (std::find(taken.begin(), taken.end(), name) != taken.end()) {
      reader_.errors.add(
          reader_.position(key.source()), path,
          fmt::format("found the name \"{}\", which expressions use already; allowed: any but {}", name, fmt::join(taken, ", ")));
    } else {
      waiting.emplace_back(name, &node);
    }
  }
  const auto waits = [&](const std::string& name) {
    return std::ranges::any_of(waiting, [&](const auto& other) { return other.first == name; });
  };
  const auto ready = [&](const auto& constant) {
    const std::optional<std::string> text = constant.second->template value<std::string>();
    return !text || std::ranges::none_of(names_of_expression(*text), waits);
  };
  while (!waiting.empty()) {
    const auto next = std::ranges::find_if(waiting, ready);
    if (next == waiting.end()) break;
    scene_.constants[next->first] = constant(next->first, *next->second);
    waiting.erase(next);
  }
  for (const auto& [name, node] : waiting) {
    reader_.errors.add(reader_.position(*node), join_path("constants", name),
                       fmt::format("found {}, which depends on itself; allowed: numbers, and expressions in other constants",
                                   toml_string(node->value_or(std::string()))));
    scene_.constants[name] = 0.0;
  }
  reader_.constants = scene_.constants;
  writer_.header("constants");
  for (const auto& [name, value] : scene_.constants) writer_.line(name, toml_number(value));
}

void SceneReader::read_sets(const toml::table& root) {
  set_names_ = {"all"};
  const toml::table* sets = section(root, "sets", "sets");
  if (!sets || sets->empty()) return;
  const ParameterTable table = set_parameters();
  Parameter condition;
  condition.type = ParameterType::expression;
  writer_.header("sets");
  for (const auto& [key, node] : *sets) {
    SetDescription set;
    set.name = key.str();
    set.position = reader_.position(node);
    const std::string path = join_path("sets", set.name);
    if (set.name == "all") {
      reader_.errors.add(reader_.position(key.source()), path,
                         "found a set named \"all\"; that set exists and holds every point; allowed: another name");
      continue;
    }
    if (set.name.empty() ||
        std::any_of(set.name.begin(), set.name.end(), [](unsigned char c) { return c < 0x20 || c == '/' || c == 0x7f; })) {
      reader_.errors.add(reader_.position(key.source()), path,
                         fmt::format("found the name {}; allowed: names that are not empty, without / and control characters",
                                     toml_string(set.name)));
      continue;
    }
    set_names_.push_back(set.name);
    if (node.is_string()) {
      if (const auto text = reader_.value(condition, node, path)) {
        set.expression = Expression(std::get<std::string>(*text), scene_.constants, false, set.position, path);
        writer_.line(set.name, toml_string(std::get<std::string>(*text)));
      }
    } else if (const auto* description = node.as_table()) {
      const ParameterValues values = reader_.read(*description, table, path);
      if (values.has("nearest")) {
        set.nearest.emplace();
        const auto& place = values.numbers("nearest");
        std::copy_n(place.begin(), std::min<std::size_t>(3, place.size()), set.nearest->begin());
      }
      if (values.has("points")) set.points = values.integers("points");
      writer_.line(set.name, writer_.inline_table(table, values));
    } else {
      reader_.refuse(
          node, path,
          fmt::format("found {}; allowed: an expression in x, y, z, {{ nearest = [...] }} or {{ points = [...] }}", found(node)));
    }
    scene_.sets.push_back(std::move(set));
  }
}

void SceneReader::read_parts(const toml::table& root) {
  const ParameterTable model = model_parameters();
  for (const Parameter& parameter : model.parameters()) {
    const toml::node* node = root.get(parameter.name);
    if (!node) {
      if (parameter.required)
        reader_.errors.add(reader_.position(root), parameter.name, "found nothing; allowed: " + allowed(parameter));
      continue;
    }
    auto part = reader_.part(parameter.kind, *node, parameter.name);
    if (!part) continue;
    if (parameter.kind == Kind::damage) part = with_second_law(part);
    writer_.part(*part);
    switch (parameter.kind) {
      case Kind::kinematics:
        scene_.kinematics = part;
        if (part->values.has("stabilization")) scene_.stabilization = part->values.shared_part("stabilization");
        break;
      case Kind::material:
        scene_.material = part;
        break;
      case Kind::damage:
        scene_.damage = part;
        if (part->values.has("no_fail")) scene_.no_fail = part->values.texts("no_fail");
        for (const std::string& set : scene_.no_fail) check_set(set, part->values.position("no_fail"), "damage.no_fail");
        break;
      default:
        scene_.integrator = part;
    }
  }
}

/// The criterion with damage.second_law, whose default follows from the kinematics and its stabilization. A catalogue that describes parts and
/// cannot make them leaves it open.
std::shared_ptr<const PartValues> SceneReader::with_second_law(std::shared_ptr<const PartValues> criterion) {
  const auto* const factory = dynamic_cast<const PartFactory*>(&parts_);
  if (criterion->values.has("second_law") || !factory || !scene_.kinematics || reader_.dimension == 0 || !reader_.errors.empty()) return criterion;
  auto complete = std::make_shared<PartValues>(*criterion);
  try {
    const Formulation formulation = make_formulation(factory->kinematics(*scene_.kinematics));
    const bool on = creates_energy(formulation, scene_.stabilization != nullptr, reader_.dimension) != nullptr;
    complete->values.set("second_law", on, criterion->values.position("type"), false);
  } catch (const InputError& error) {
    reader_.errors.add(scene_.kinematics->values.position("type"), error);
  }
  return complete;
}

const toml::table* SceneReader::section(const toml::table& parent, const std::string& key, const std::string& path,
                                        bool required) {
  const toml::node* node = parent.get(key);
  if (node && node->is_table()) return node->as_table();
  if (node && !(path == "body" && node->is_array())) {
    reader_.refuse(*node, path, fmt::format("found {}; allowed: a table [{}]", found(*node), path));
  }
  if (!node && required)
    reader_.errors.add(reader_.position(parent), path, fmt::format("found nothing; allowed: a table [{}]", path));
  return nullptr;
}

std::vector<const toml::table*> SceneReader::sections(const toml::table& parent, const std::string& key,
                                                      const std::string& path) {
  const toml::node* node = parent.get(key);
  if (!node) return {};
  std::vector<const toml::table*> tables;
  const toml::array* array = node->as_array();
  bool sound = array != nullptr;
  for (std::size_t i = 0; sound && i < array->size(); ++i) {
    tables.push_back(array->get(i)->as_table());
    sound = tables.back() != nullptr;
  }
  if (sound) return tables;
  reader_.refuse(*node, path, fmt::format("found {}; allowed: [[{}]], a list of tables", found(*node), path));
  return {};
}

void SceneReader::check_set(const std::string& name, const SourcePosition& position, const std::string& key) {
  if (std::find(set_names_.begin(), set_names_.end(), name) != set_names_.end()) return;
  reader_.errors.add(position, key,
                     fmt::format("found the unknown set {}; allowed: {}{}", toml_string(name), fmt::join(set_names_, ", "),
                                 did_you_mean(name, set_names_)));
}

std::string SceneReader::set_of(const ParameterValues& values) {
  if (!values.has("set")) return {};
  check_set(values.text("set"), values.position("set"), join_path(values.path(), "set"));
  return values.text("set");
}

std::vector<Expression> SceneReader::expressions(const ParameterValues& values, const std::string& key, bool with_time) const {
  std::vector<Expression> list;
  for (const auto& value : values.expressions(key)) {
    list.emplace_back(value, scene_.constants, with_time, values.position(key),
                      fmt::format("{}.{}.{}", values.path(), key, list.size()));
  }
  return list;
}

std::vector<std::optional<Expression>> SceneReader::components(const ParameterValues& values, const std::string& key) const {
  std::vector<std::optional<Expression>> list;
  for (const auto& value : values.expressions(key)) {
    const auto* text = std::get_if<std::string>(&value);
    if (text && *text == "free")
      list.emplace_back(std::nullopt);
    else
      list.emplace_back(Expression(value, scene_.constants, true, values.position(key),
                                   fmt::format("{}.{}.{}", values.path(), key, list.size())));
  }
  return list;
}

std::filesystem::path SceneReader::from_scene_folder(const std::string& path) const {
  return std::filesystem::absolute(scene_.file.parent_path() / path).lexically_normal();
}

std::optional<std::filesystem::path> SceneReader::existing_file(ParameterValues& values, const std::string& key) {
  if (!values.has(key)) return std::nullopt;
  const SourcePosition position = values.position(key);
  const std::filesystem::path file = from_scene_folder(values.text(key));
  std::error_code failure;
  const auto status = std::filesystem::status(file, failure);
  if (!std::filesystem::is_regular_file(status)) {
    const char* what = std::filesystem::is_directory(status) ? "is a folder" : "does not exist";
    reader_.errors.add(
        position, join_path(values.path(), key),
        fmt::format("found {}, but {} {}; allowed: an existing file", toml_string(values.text(key)), file.string(), what));
    return std::nullopt;
  }
  values.set(key, file.string(), position);
  return file;
}

}  // namespace perikit
