// [body], [family], [[region]], [[crack]]: what the body is.
#include <fmt/format.h>

#include <algorithm>

#include "scene/geometry_checks.hpp"
#include "scene/scene_reader.hpp"
#include "scene/sections.hpp"
#include "scene/toml/toml_text.hpp"

namespace perikit {

namespace {

std::array<double, 3> coordinates(const std::vector<double>& values) {
  std::array<double, 3> x{};
  std::copy_n(values.begin(), std::min<std::size_t>(3, values.size()), x.begin());
  return x;
}

}  // namespace

void SceneReader::read_body(const toml::table& root) {
  const toml::table* body = section(root, "body", "body", true);
  if (!body) return;
  const toml::node* given = body->get("dimension");
  const auto dimension = given ? reader_.whole_number(*given) : std::nullopt;
  if (dimension && *dimension >= 1 && *dimension <= 3) reader_.dimension = static_cast<int>(*dimension);

  // Keys of another dimension are known words: say so instead of calling them unknown.
  std::vector<std::string> others{"lattice", "points"};
  const ParameterTable table = body_parameters(reader_.dimension), every = body_parameters(0);
  for (const Parameter& parameter : every.parameters()) {
    if (table.find(parameter.name) || !body->contains(parameter.name)) continue;
    others.push_back(parameter.name);
    const int fits = body_parameters(1).find(parameter.name) ? 1 : 2;
    reader_.refuse(*body->get(parameter.name), "body." + parameter.name,
                   fmt::format("found in a body of dimension {}; allowed: only with dimension = {}", reader_.dimension, fits));
  }
  const ParameterValues values = reader_.read(*body, table, "body", others);
  writer_.header("body");
  writer_.lines(table, values);

  BodyDescription& description = scene_.body;
  description.position = reader_.position(*body);
  description.dimension = reader_.dimension;
  const auto chosen = [&](const char* key, const char* word) { return values.has(key) && values.text(key) == word; };
  if (reader_.dimension == 1) description.space = chosen("line", "strain") ? Space::line_strain : Space::line_stress;
  if (reader_.dimension == 2) description.space = chosen("plane", "strain") ? Space::plane_strain : Space::plane_stress;
  for (const char* section : {"thickness", "area"}) {
    if (reader_.dimension > 0 && values.has(section)) description.section = values.number(section);
  }

  if (body->contains("lattice") == body->contains("points")) {
    reader_.errors.add(description.position, "body",
                       fmt::format("found {}; allowed: exactly 1 of [body.lattice], [body.points]",
                                   body->contains("lattice") ? "lattice, points" : "none of them"));
  }
  read_lattice(*body);
  read_points(*body);
}

void SceneReader::read_lattice(const toml::table& body) {
  const toml::table* section = this->section(body, "lattice", "body.lattice");
  if (!section) return;
  const ParameterTable table = lattice_parameters();
  const ParameterValues values = reader_.read(*section, table, "body.lattice");
  writer_.header("body.lattice");
  writer_.lines(table, values);
  if (reader_.dimension == 0 || !values.has("spacing") || !values.has("lower") || !values.has("upper")) return;

  LatticeDescription lattice;
  lattice.position = values.position("inside");
  lattice.spacing = values.number("spacing");
  lattice.lower = coordinates(values.numbers("lower"));
  lattice.upper = coordinates(values.numbers("upper"));
  if (values.has("jitter")) lattice.jitter = values.number("jitter");
  lattice_seed_ = values.has("seed");
  if (lattice_seed_) lattice.seed = values.integer("seed");
  scene_.body.voronoi = values.has("volume") && values.text("volume") == "voronoi";
  scene_.body.volume_position = values.position("volume");
  if (values.has("inside")) {
    lattice.inside =
        Expression(values.expression("inside"), scene_.constants, false, values.position("inside"), "body.lattice.inside");
  }
  bool sound = true;
  for (std::size_t axis = 0; axis < static_cast<std::size_t>(reader_.dimension); ++axis) {
    if (lattice.upper[axis] > lattice.lower[axis]) continue;
    sound = false;
    reader_.errors.add(values.position("upper"), fmt::format("body.lattice.upper.{}", axis),
                       fmt::format("found {}; allowed: above lower = {}", lattice.upper[axis], lattice.lower[axis]));
  }
  const double count = lattice_point_count(lattice, reader_.dimension);
  if (sound && !(count >= 1 && count <= largest_point_count)) {
    reader_.errors.add(values.position("spacing"), "body.lattice.spacing",
                       fmt::format("found {}, which gives about {:.3g} points; allowed: a spacing that gives 1 to {:.3g} points",
                                   lattice.spacing, count, largest_point_count));
  }
  scene_.body.lattice = std::move(lattice);
}

void SceneReader::read_points(const toml::table& body) {
  const toml::table* section = this->section(body, "points", "body.points");
  if (!section) return;
  const ParameterTable table = points_parameters();
  ParameterValues values = reader_.read(*section, table, "body.points");
  if (values.has("file")) {
    const std::string kind = std::filesystem::path(values.text("file")).extension().string();
    if (kind == ".csv" || kind == ".h5")
      scene_.body.points_file = existing_file(values, "file");
    else {
      reader_.errors.add(values.position("file"), "body.points.file",
                         fmt::format("found {}; allowed: a file that ends in .csv or .h5", toml_string(values.text("file"))));
    }
  }
  writer_.header("body.points");
  writer_.lines(table, values);
  read_points_box(values);
}

/// What clips Voronoi cells of the points of a file.
void SceneReader::read_points_box(const ParameterValues& values) {
  BodyDescription& body = scene_.body;
  body.voronoi = values.has("volume") && values.text("volume") == "voronoi";
  body.volume_position = values.position("volume");
  for (const char* key : {"lower", "upper", "inside"}) {
    if (!values.has(key) || body.voronoi) continue;
    reader_.errors.add(values.position(key), fmt::format("body.points.{}", key),
                       "found with volumes from the file; allowed: with volume = \"voronoi\"");
  }
  if (values.has("lower")) body.points_lower = coordinates(values.numbers("lower"));
  if (values.has("upper")) body.points_upper = coordinates(values.numbers("upper"));
  if (values.has("inside"))
    body.points_inside =
        Expression(values.expression("inside"), scene_.constants, false, values.position("inside"), "body.points.inside");
}

void SceneReader::read_family(const toml::table& root) {
  const toml::table* family = section(root, "family", "family", true);
  if (!family) return;
  const ParameterTable table = family_parameters();
  const ParameterValues values = reader_.read(*family, table, "family");
  writer_.header("family");
  writer_.lines(table, values);
  if (values.has("horizon")) scene_.horizon = values.number("horizon");
  if (values.has("horizon_ratio")) scene_.horizon_ratio = values.number("horizon_ratio");
  for (const char* key : {"horizon", "horizon_ratio"})
    if (values.has(key)) scene_.horizon_position = values.position(key);
  if (values.has("partial_volume")) scene_.partial_volume = values.boolean("partial_volume");
  scene_.partial_volume_position = values.position("partial_volume");
  if (values.given("interfaces")) scene_.laminates = values.text("interfaces") == "laminate";
  scene_.laminates_position = values.position("interfaces");
  if (values.has("consistent")) scene_.consistent = values.boolean("consistent");
  scene_.consistent_position = values.position("consistent");
  if (values.has("influence")) scene_.influence = values.shared_part("influence");
  if (scene_.horizon > 0 && scene_.body.lattice && scene_.horizon < scene_.body.lattice->spacing) {
    reader_.errors.add(values.position("horizon"), "family.horizon",
                       fmt::format("found {}; allowed: at least the spacing {}", scene_.horizon, scene_.body.lattice->spacing));
  }
}

void SceneReader::read_regions(const toml::table& root) {
  const ParameterTable table = region_parameters();
  for (const toml::table* region : sections(root, "region", "region")) {
    const ParameterValues values = reader_.read(*region, table, fmt::format("region.{}", scene_.regions.size()));
    writer_.header("region", true);
    writer_.lines(table, values);
    auto material = values.has("material") ? values.shared_part("material") : nullptr;
    scene_.regions.push_back({set_of(values), std::move(material), reader_.position(*region)});
  }
}

void SceneReader::read_interfaces(const toml::table& root) {
  const ParameterTable table = interface_parameters();
  std::vector<std::string> regions{"rest"};
  for (const RegionDescription& region : scene_.regions) regions.push_back(region.set);
  for (const toml::table* interface : sections(root, "interface", "interface")) {
    const std::string path = fmt::format("interface.{}", scene_.interfaces.size());
    const ParameterValues values = reader_.read(*interface, table, path);
    writer_.header("interface", true);
    writer_.lines(table, values);
    InterfaceDescription description;
    description.position = values.position("between");
    if (values.has("damage")) description.damage = values.shared_part("damage");
    const auto refuse = [&](const SourcePosition& at, const std::string& key, const std::string& message) {
      reader_.errors.add(at, join_path(path, key), message);
    };
    if (values.has("between")) {
      const std::vector<std::string>& names = values.texts("between");
      std::copy_n(names.begin(), 2, description.between.begin());
      for (const std::string& name : names)
        if (std::find(regions.begin(), regions.end(), name) == regions.end())
          refuse(description.position, "between",
                 fmt::format("found {}; allowed: sets of [[region]], and \"rest\" for what belongs to none: {}{}",
                             toml_string(name), fmt::join(regions, ", "), did_you_mean(name, regions)));
      if (names[0] == names[1])
        refuse(description.position, "between",
               fmt::format("found {} twice; allowed: two different regions", toml_string(names[0])));
      for (const InterfaceDescription& other : scene_.interfaces)
        if (std::is_permutation(names.begin(), names.end(), other.between.begin()))
          refuse(description.position, "between",
                 fmt::format("found {} and {} again; allowed: each pair of regions once", toml_string(names[0]),
                             toml_string(names[1])));
    }
    if (!scene_.damage) {
      refuse(reader_.position(*interface), "damage", "found in a scene without [damage]; allowed: beside [damage]");
    } else if (description.damage) {
      const ParameterValues &own = description.damage->values, &all = scene_.damage->values;
      if (description.damage->type != scene_.damage->type)
        refuse(values.position("damage"), "damage",
               fmt::format("found \"{}\"; allowed: the criterion of [damage], \"{}\"", description.damage->type,
                           scene_.damage->type));
      else
        for (const std::string& key : own.keys()) {
          const ParameterValue* value = own.find(key);
          const ParameterValue* of_body = all.find(key);
          if (std::holds_alternative<double>(*value) || (of_body && *of_body == *value)) continue;
          refuse(own.position(key), "damage." + key,
                 "found another value than in [damage]; allowed: that one. Only numbers differ at interfaces");
        }
    }
    scene_.interfaces.push_back(std::move(description));
  }
}

void SceneReader::read_cracks(const toml::table& root) {
  const ParameterTable table = crack_parameters();
  for (const toml::table* crack : sections(root, "crack", "crack")) {
    const std::string path = fmt::format("crack.{}", scene_.cracks.size());
    CrackDescription description;
    description.position = reader_.position(*crack);
    bool fits = true;
    for (const std::string key : {"segment", "polygon"}) {
      if (!crack->contains(key) || reader_.dimension == 0 || reader_.dimension == (key == "segment" ? 2 : 3)) continue;
      fits = false;
      reader_.refuse(
          *crack->get(key), join_path(path, key),
          fmt::format("found a {} in a body of dimension {}; allowed: segment in 2D, polygon in 3D", key, reader_.dimension));
    }
    if (fits) {
      const ParameterValues values = reader_.read(*crack, table, path);
      writer_.header("crack", true);
      writer_.lines(table, values);
      for (const std::string key : {"segment", "polygon"}) {
        if (!values.has(key)) continue;
        for (const auto& vertex : values.points(key)) description.vertices.push_back(coordinates(vertex));
        const std::string fault = crack_fault(description.vertices);
        if (fault.empty()) continue;
        reader_.errors.add(values.position(key), join_path(path, key),
                           fmt::format("found {}; allowed: {}", fault,
                                       key == "segment" ? "two different ends" : "a plane polygon with an area"));
      }
    }
    scene_.cracks.push_back(std::move(description));
  }
}

}  // namespace perikit
