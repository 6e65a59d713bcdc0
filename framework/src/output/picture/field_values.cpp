#include "output/picture/field_values.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "perikit/core/errors.hpp"

namespace perikit {

namespace {

struct KnownField {
  const char *name, *label, *unit;
};
constexpr KnownField known_fields[] = {
    {"displacement", "displacement", "m"},
    {"velocity", "velocity", "m/s"},
    {"acceleration", "acceleration", "m/s²"},
    {"internal_force", "internal force density", "N/m³"},
    {"external_force", "external force density", "N/m³"},
    {"reaction", "reaction", "N"},
    {"strain_energy_density", "strain energy density", "J/m³"},
    {"first_piola", "first Piola-Kirchhoff stress", "Pa"},
    {"cauchy", "Cauchy stress", "Pa"},
    {"von_mises", "von Mises stress", "Pa"},
    {"volume", "volume", "m³"},
};

using Tensor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

double von_mises(const Tensor& stress) {
  const Tensor deviator = stress - stress.trace() / 3 * Tensor::Identity();
  return std::sqrt(1.5) * deviator.norm();
}

std::vector<std::string> component_names(int width) {
  if (width == 3) return {"x", "y", "z", "magnitude"};
  if (width == 9) return {"xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz", "magnitude", "trace", "determinant", "von_mises"};
  return {};
}

double component_value(const double* row, int width, std::size_t component, const std::string& name) {
  if (component < static_cast<std::size_t>(width)) return row[component];
  if (width == 3) return Eigen::Map<const Eigen::Vector3d>(row).norm();
  const Tensor tensor = Eigen::Map<const Tensor>(row);
  if (name == "trace") return tensor.trace();
  if (name == "determinant") return tensor.determinant();
  return name == "von_mises" ? von_mises(tensor) : tensor.norm();
}

const KnownField* known_field(const std::string& field) {
  const auto known = std::find_if(std::begin(known_fields), std::end(known_fields), [&](const auto& k) { return field == k.name; });
  return known == std::end(known_fields) ? nullptr : known;
}

}  // namespace

std::string field_unit(const std::string& field) {
  const KnownField* known = known_field(field);
  return known ? known->unit : "";
}

FieldValues field_values(const std::string& field, int width, std::span<const double> data, const std::string& component) {
  FieldValues result;
  result.label = field;
  std::replace(result.label.begin(), result.label.end(), '_', ' ');
  if (const KnownField* known = known_field(field)) {
    result.label = known->label;
    result.unit = known->unit;
  }
  if (width == 1) {
    if (!component.empty()) throw InputError({}, "component", fmt::format("found '{}'; '{}' is a scalar", component, field));
    result.values.assign(data.begin(), data.end());
    return result;
  }
  const std::vector<std::string> names = component_names(width);
  if (names.empty()) throw InputError({}, field, fmt::format("found rows of {}; a picture needs rows of 1, 3 or 9", width));
  const bool stress = field == "cauchy" || field == "first_piola";
  const std::string name = !component.empty() ? component : stress ? "von_mises" : "magnitude";
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) {
    throw InputError({}, "component",
                     fmt::format("found '{}'; '{}' has {}{}", name, field, fmt::join(names, ", "), did_you_mean(name, names)));
  }
  const auto index = static_cast<std::size_t>(found - names.begin());
  for (std::size_t p = 0; p + static_cast<std::size_t>(width) <= data.size(); p += static_cast<std::size_t>(width)) {
    result.values.push_back(component_value(&data[p], width, index, name));
  }
  result.label += name == "von_mises" ? ", von Mises" : ", " + name;
  if (name == "determinant" && !result.unit.empty()) result.unit += "³";
  return result;
}

}  // namespace perikit
