#include "output/picture/field_values.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "output_fields/point_field.hpp"
#include "output_fields/state_field.hpp"
#include "perikit/core/errors.hpp"

namespace perikit {

namespace {

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

}  // namespace

std::string field_unit(const std::string& field) {
  const PointField* known = find_point_field(field);
  return known ? known->unit : field == "volume" ? "m³" : "";
}

FieldValues field_values(const std::string& field, int width, std::span<const double> data, const std::string& component) {
  FieldValues result;
  result.unit = field_unit(field);
  if (const PointField* known = find_point_field(field)) {
    result.label = known->label;
  } else {
    result.label = names_state(field) ? std::string(variable_of(field)) : field;
    std::ranges::replace(result.label, '_', ' ');
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
