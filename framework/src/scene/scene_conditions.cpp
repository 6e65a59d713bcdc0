// [initial], [[boundary]], [[symmetry]], [[periodic]], [[load]], [[term]], [output], [run]: what happens to the body, and what is kept of it. Columns of the
// history: scene_history.cpp.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "output_fields/point_field.hpp"
#include "scene/scene_reader.hpp"
#include "scene/sections.hpp"
#include "scene/toml/toml_text.hpp"

namespace perikit {

void SceneReader::read_initial(const toml::table& root) {
  const toml::table* initial = section(root, "initial", "initial");
  if (!initial) return;
  const ParameterTable table = initial_parameters();
  ParameterValues values = reader_.read(*initial, table, "initial");
  const auto fill = [&](const char* key, std::vector<std::optional<Expression>>& components) {
    if (!values.has(key)) return;
    for (Expression& component : expressions(values, key, false)) components.emplace_back(std::move(component));
  };
  fill("displacement", scene_.initial_displacement);
  fill("velocity", scene_.initial_velocity);
  scene_.initial_velocity_position = values.position("velocity");
  scene_.initial_from = existing_file(values, "from");
  scene_.initial_from_position = values.position("from");
  writer_.header("initial");
  writer_.lines(table, values);
}

void SceneReader::read_boundaries(const toml::table& root) {
  const ParameterTable table = boundary_parameters();
  for (const toml::table* boundary : sections(root, "boundary", "boundary")) {
    const ParameterValues values = reader_.read(*boundary, table, fmt::format("boundary.{}", scene_.boundaries.size()));
    writer_.header("boundary", true);
    writer_.lines(table, values);
    BoundaryDescription description;
    description.set = set_of(values);
    if (values.has("face")) {
      description.face = values.text("face");
      check_axis(description.face[1], values, "face");
      description.face_position = values.position(values.has("at") ? "at" : "face");
      if (!values.has("set")) description.set = "all";
    } else if (values.has("surface")) {
      description.set = "all";
      description.face_position = values.position("surface");
    } else if (!values.has("set") && !boundary->contains("surface")) {
      reader_.errors.add(reader_.position(*boundary), values.path() + ".set", "found nothing; allowed: " + allowed(*table.find("set")) + ", or a face or surface of the body");
    }
    if (values.has("at")) {
      description.at = values.number("at");
      if (!values.has("face")) reader_.errors.add(values.position("at"), values.path() + ".at", "found it without face; allowed: only with face");
    }
    description.velocity = values.has("velocity");
    for (const char* key : {"displacement", "velocity"}) {
      if (values.has(key)) description.components = components(values, key);
    }
    description.position = values.position(description.velocity ? "velocity" : "displacement");
    if (values.has("surface")) read_surface(values, description);
    description.ramp = ramp_of(values, description.components);
    scene_.boundaries.push_back(std::move(description));
  }
}

void SceneReader::read_surface(const ParameterValues& values, BoundaryDescription& boundary) {
  const std::string key = values.path() + ".surface";
  for (const char* other : {"set", "face"})
    if (values.has(other))
      reader_.errors.add(values.position("surface"), key, fmt::format("found it together with {}; allowed: one of the two, each in its own [[boundary]]", other));
  boundary.surface.emplace(values.expression("surface"), scene_.constants, false, values.position("surface"), key);
  for (std::size_t c = 0; c < boundary.components.size(); ++c)
    if (!boundary.components[c])
      reader_.errors.add(boundary.position, fmt::format("{}.{}.{}", values.path(), boundary.velocity ? "velocity" : "displacement", c),
                         "found \"free\" on a surface, whose normal is no axis, so that what is free and what is held would depend on each other; "
                         "allowed: a number or an expression, or a face across an axis");
}

RampDescription SceneReader::ramp_of(const ParameterValues& values, const std::vector<std::optional<Expression>>& components) {
  if (!values.has("ramp")) return {};
  const bool ramp = values.boolean("ramp");
  if (ramp && std::ranges::any_of(components, [](const auto& value) { return value && value->depends_on_time(); }))
    reader_.errors.add(values.position("ramp"), join_path(values.path(), "ramp"),
                       "found true with a value that mentions t and says itself how it grows; allowed: values without t");
  return {ramp, values.position("ramp")};
}

void SceneReader::check_axis(char axis, const ParameterValues& values, const char* key) {
  if (reader_.dimension <= 0 || axis - 'x' < reader_.dimension) return;
  reader_.errors.add(values.position(key), join_path(values.path(), key),
                     fmt::format("found \"{}\" in a body of dimension {}; allowed: the axes of the body", values.text(key), reader_.dimension));
}

void SceneReader::read_planes(const toml::table& root) {
  const auto number = [](const ParameterValues& values, const char* key) {
    return values.has(key) ? std::optional(values.number(key)) : std::nullopt;
  };
  const auto read = [&](const char* key, const ParameterTable& table, std::size_t count, auto&& add) {
    for (const toml::table* section : sections(root, key, key)) {
      const ParameterValues values = reader_.read(*section, table, fmt::format("{}.{}", key, count++));
      writer_.header(key, true);
      writer_.lines(table, values);
      if (!values.has("axis")) continue;
      check_axis(values.text("axis")[0], values, "axis");
      add(values, values.text("axis")[0] - 'x');
    }
  };
  read("symmetry", symmetry_parameters(), 0, [&](const ParameterValues& values, int axis) {
    scene_.symmetries.push_back({axis, number(values, "at"), values.position(values.has("at") ? "at" : "axis")});
  });
  read("periodic", periodic_parameters(), 0, [&](const ParameterValues& values, int axis) {
    scene_.periodics.push_back({axis, number(values, "lower"), number(values, "upper"), values.position("axis")});
  });
}

void SceneReader::read_loads(const toml::table& root) {
  const ParameterTable table = load_parameters();
  for (const toml::table* load : sections(root, "load", "load")) {
    const std::string path = fmt::format("load.{}", scene_.loads.size());
    const ParameterValues values = reader_.read(*load, table, path);
    writer_.header("load", true);
    writer_.lines(table, values);
    LoadDescription description;
    description.position = values.position("face");
    description.set = set_of(values);
    using Type = LoadDescription::Type;
    for (const auto& [key, type] :
         {std::pair{"force", Type::force}, {"body_force", Type::body_force}, {"traction", Type::traction}}) {
      if (!values.has(key)) continue;
      description.type = type;
      description.components = expressions(values, key, true);
    }
    if (values.has("pressure")) {
      description.type = Type::pressure;
      description.components.emplace_back(values.expression("pressure"), scene_.constants, true, values.position("pressure"),
                                          path + ".pressure");
      description.follower = values.boolean("follower");
      if (!values.has("face")) description.position = values.position("pressure");
    } else if (values.has("follower") && values.boolean("follower")) {
      reader_.errors.add(values.position("follower"), path + ".follower",
                         "found it without pressure; allowed: only with pressure");
    }
    if (load->contains("traction") && !load->contains("face")) {
      reader_.errors.add(reader_.position(*load), path + ".face",
                         "found nothing beside traction; allowed: " + allowed(*table.find("face")));
    }
    if (values.has("face")) {
      description.face = values.text("face");
      if (!load->contains("traction") && !load->contains("pressure")) {
        reader_.errors.add(
            values.position("face"), path + ".face",
            fmt::format("found \"{}\" without traction; allowed: only with traction or pressure", description.face));
      } else {
        check_axis(description.face[1], values, "face");
      }
    }
    description.ramp = ramp_of(values, {description.components.begin(), description.components.end()});
    scene_.loads.push_back(std::move(description));
  }
}

void SceneReader::read_terms(const toml::table& root) {
  std::size_t count = 0;
  for (const toml::table* term : sections(root, "term", "term")) {
    const auto part = reader_.part(Kind::term, *term, fmt::format("term.{}", count++));
    if (!part) continue;
    writer_.part(*part);
    scene_.terms.push_back({set_of(part->values), part});
  }
}

void SceneReader::read_output(const toml::table& root) {
  static const toml::table none;
  const toml::table* given = section(root, "output", "output");
  const toml::table& output = given ? *given : none;
  const ParameterTable table = output_parameters();
  const ParameterValues values = reader_.read(output, table, "output", {"history"});
  writer_.header("output");
  writer_.lines(table, values);

  OutputDescription& description = scene_.output;
  if (values.has("frames")) description.frames = values.integer("frames");
  if (values.has("every")) description.every = values.integer("every");
  if (values.has("times")) description.times = values.numbers("times");
  if (std::adjacent_find(description.times.begin(), description.times.end(), std::greater_equal<>()) != description.times.end()) {
    reader_.errors.add(values.position("times"), "output.times",
                       "found times that do not ascend; allowed: each above the one before");
  }
  if (values.has("history_every")) description.history_every = values.integer("history_every");
  if (values.has("checkpoint_every")) description.checkpoint_every = values.integer("checkpoint_every");
  if (values.has("fields")) description.fields = values.texts("fields");
  description.fields_position = values.position("fields");
  for (std::size_t i = 0; i < description.fields.size(); ++i) {
    if (std::count(description.fields.begin(), description.fields.begin() + static_cast<std::ptrdiff_t>(i),
                   description.fields[i]) == 0)
      continue;
    reader_.errors.add(values.position("fields"), fmt::format("output.fields.{}", i),
                       fmt::format("found \"{}\" twice; allowed: each field once", description.fields[i]));
  }
  const toml::array* const fields = output["fields"].as_array();
  for (std::size_t i = 0; i < description.fields.size(); ++i)
    check_state(description.fields[i], fields && i < fields->size() ? reader_.position(*fields->get(i)) : values.position("fields"), fmt::format("output.fields.{}", i));
  read_history(output);
}

const std::vector<StateField>* SceneReader::states() {
  const auto* const factory = dynamic_cast<const PartFactory*>(&parts_);
  if (states_found_) return &scene_.output.states;
  if (!factory || !scene_.material || reader_.dimension == 0 || !reader_.errors.empty()) return nullptr;
  std::vector<std::shared_ptr<const PartValues>> parts{scene_.material};
  for (const RegionDescription& region : scene_.regions) parts.push_back(region.material);
  std::vector<std::unique_ptr<Material>> laws;
  std::vector<const Material*> all;
  for (const auto& part : parts) {
    try {
      all.push_back(laws.emplace_back(factory->material(*part)).get());
    } catch (const InputError& error) {
      reader_.errors.add(part->values.position("type"), error);
      return nullptr;
    }
  }
  scene_.output.states = state_fields(all, scene_.body.space);
  states_found_ = true;
  return &scene_.output.states;
}

int SceneReader::width_of(const std::string& field) {
  if (const PointField* const known = find_point_field(field)) return known->width;
  const std::vector<StateField>* const known = states();
  if (!known) return 0;
  const auto found = std::ranges::find(*known, field, &StateField::name);
  return found == known->end() ? 0 : found->width;
}

void SceneReader::check_state(const std::string& field, const SourcePosition& position, const std::string& key) {
  const std::vector<StateField>* const known = names_state(field) ? states() : nullptr;
  if (!known) return;
  const auto found = std::ranges::find(*known, field, &StateField::name);
  if (found != known->end() && found->width > 0) return;
  std::vector<std::string> names, laws{scene_.material->type};
  for (const StateField& state : *known)
    if (state.width > 0) names.push_back(state.name);
  for (const RegionDescription& region : scene_.regions)
    if (std::ranges::find(laws, region.material->type) == laws.end()) laws.push_back(region.material->type);
  const std::string why = found != known->end() ? ", by which two materials of this scene mean different things" : "";
  const std::string allowed = names.empty() ? fmt::format("fields without state:, as {} remembers nothing", fmt::join(laws, " and ")) : fmt::format("\"{}\"{}", fmt::join(names, "\", \""), did_you_mean(field, names));
  reader_.errors.add(position, key, fmt::format("found \"{}\"{}; allowed: {}", field, why, allowed));
}

void SceneReader::read_run(const toml::table& root) {
  static const toml::table none;
  const toml::table* given = section(root, "run", "run");
  const ParameterTable table = run_parameters();
  const ParameterValues values = reader_.read(given ? *given : none, table, "run");
  writer_.header("run");
  writer_.lines(table, values);
  if (values.has("skip")) scene_.skip = values.boolean("skip");
  if (values.has("share")) scene_.share = values.boolean("share");
  if (values.has("threads")) scene_.threads = static_cast<int>(values.integer("threads"));
  if (values.has("weak_springs")) scene_.weak_springs = values.number("weak_springs");
  scene_.weak_springs_position = values.position("weak_springs");
  if (values.has("silence")) scene_.silence = values.texts("silence");
  if (!values.has("seed")) return;
  scene_.seed = values.integer("seed");
  if (scene_.body.lattice && !lattice_seed_) scene_.body.lattice->seed = scene_.seed;
}

}  // namespace perikit
