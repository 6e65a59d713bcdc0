#include "output/picture/axis_units.hpp"

#include <toml++/toml.h>

#include <fstream>
#include <iterator>

#include "output/picture/field_values.hpp"
#include "perikit/core/errors.hpp"
#include "scene/toml/toml_reader.hpp"

namespace perikit {

namespace {

/// Of a column that the scene asks for; that of one with a value from others nobody knows.
std::string unit_of(const toml::table& column) {
  const std::string quantity = column["quantity"].value_or(std::string()), reduce = column["reduce"].value_or(std::string());
  if (reduce == "error") return "";
  if (reduce == "moment") return "N m";
  if (reduce == "extent" || reduce == "tip") return "m";
  if (reduce == "area") return "m²";
  return reduce == "mass" ? "kg" : field_unit(quantity);
}

}  // namespace

SceneUnits::SceneUnits(const std::string& scene) {
  toml::table root;
  try {
    root = parse_toml(scene, "scene.toml");
  } catch (const InputError&) {
    return;
  }
  const auto integrator = root["integrator"];
  if (integrator["end_time"]) time_ = std::string("s");
  else if (integrator["steps"]) time_name_ = "load parameter";
  const toml::array* history = root["output"]["history"].as_array();
  if (!history) return;
  for (const toml::node& entry : *history) {
    const toml::table* table = entry.as_table();
    if (table) own_.emplace_back((*table)["name"].value_or(std::string()), unit_of(*table));
  }
}

std::string SceneUnits::column(const std::string& name) const {
  if (name == "time" || name == "time_step") return time_;
  for (const char* energy : {"strain_energy", "kinetic_energy", "dissipated_energy", "dissipated_by_laws", "external_work"})
    if (name == energy) return "J";
  for (const auto& [own, unit] : own_)
    if (name == own) return unit;
  return "";
}

std::string scene_text(const std::filesystem::path& folder) {
  std::ifstream stream(folder / "scene.toml", std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

}  // namespace perikit
