#include "perikit/problem/motion.hpp"
#include "perikit/run/point_fields.hpp"

#include <algorithm>
#include <array>
#include <stdexcept>

namespace perikit {

const std::vector<std::string>& PointFields::names() {
  static const std::vector<std::string> all{
      "displacement", "velocity",    "acceleration", "internal_force", "external_force", "reaction", "strain_energy_density", "deformation_gradient",
      "first_piola",  "cauchy",      "von_mises",    "jacobian",       "damage",         "shape_tensor_condition", "material_id"};
  return all;
}

bool PointFields::needs_gradients(const std::string& name) {
  static const std::array fields{"deformation_gradient", "first_piola", "cauchy", "von_mises", "jacobian", "shape_tensor_condition"};
  return std::find(fields.begin(), fields.end(), name) != fields.end();
}

int PointFields::width(const std::string& name) {
  static const std::array vectors{"displacement", "velocity", "acceleration", "internal_force", "external_force", "reaction"};
  static const std::array tensors{"deformation_gradient", "first_piola", "cauchy"};
  if (std::find(vectors.begin(), vectors.end(), name) != vectors.end()) return 3;
  return std::find(tensors.begin(), tensors.end(), name) != tensors.end() ? 9 : 1;
}

int PointFields::column(const std::string& name, const std::string& component) {
  const int w = width(name);
  const auto axis = [&](char c) {
    if (c < 'x' || c > 'z') throw std::out_of_range(component);
    return c - 'x';
  };
  if (w == 1 && component.empty()) return 0;
  if (w > 1 && (component.empty() || component == "magnitude")) return -1;
  if (w == 3 && component.size() == 1) return axis(component[0]);
  if (w == 9 && component.size() == 2) return 3 * axis(component[0]) + axis(component[1]);
  throw std::out_of_range(component);
}

OutputField PointFields::vector(const std::string& name, ConstFieldView field, bool per_volume) const {
  const auto internal = problem_.body().internal();
  OutputField out{name, 3, std::vector<double>(3 * internal.size(), 0.0)};
  for (std::size_t p = 0; p < internal.size(); ++p) {
    const auto i = static_cast<std::size_t>(internal[p]);
    const double factor = per_volume ? 1.0 / problem_.body().volume(i) : 1.0;
    for (int c = 0; c < field.components && field.data; ++c) out.data[3 * p + static_cast<std::size_t>(c)] = factor * field.component(c)[i];
  }
  return out;
}

OutputField PointFields::scalar(const std::string& name, ConstFieldView field) const {
  const auto internal = problem_.body().internal();
  OutputField out{name, 1, std::vector<double>(internal.size())};
  for (std::size_t p = 0; p < internal.size(); ++p) out.data[p] = field.data[internal[p]];
  return out;
}

OutputField PointFields::tensor(const std::string& name, ConstFieldView field, bool identity) const {
  const auto internal = problem_.body().internal();
  const auto d = static_cast<std::size_t>(problem_.dimension());
  OutputField out{name, 9, std::vector<double>(9 * internal.size(), 0.0)};
  for (std::size_t p = 0; p < internal.size(); ++p) {
    for (int c = 0; c < field.components; ++c) {
      const auto k = static_cast<std::size_t>(c);
      // In-space components row by row, then the other diagonal ones.
      const std::size_t at = field.components == 9 ? k : k < d * d ? 3 * (k / d) + k % d : 4 * (d + k - d * d);
      out.data[9 * p + at] = field.component(c)[internal[p]];
    }
    for (std::size_t a = 0; a < 3 && identity; ++a) out.data[9 * p + 4 * a] += 1.0;
  }
  return out;
}

const PointSamples& PointFields::samples() {
  if (!samples_) problem_.terms().sample(problem_.state().displacement(), samples_.emplace());
  return *samples_;
}

const OutputField& PointFields::get(const std::string& name) {
  const auto [entry, fresh] = cache_.try_emplace(name);
  if (fresh) entry->second = compute(name);
  return entry->second;
}

OutputField PointFields::compute(const std::string& name) {
  if (name == "displacement") return vector(name, problem_.state().displacement(), false);
  if (name == "velocity") return vector(name, moves_ ? ConstFieldView(problem_.state().velocity()) : ConstFieldView(), false);
  if (name == "acceleration") return vector(name, dynamic_ ? accelerations(problem_, problem_.state().time) : problem_.make_field(), false);
  if (name == "internal_force") return vector(name, problem_.state().internal_force(), true);
  if (name == "external_force") return vector(name, problem_.loads().any() ? ConstFieldView(problem_.state().external_force()) : ConstFieldView(), true);
  if (name == "reaction") return vector(name, reactions(problem_, dynamic_, problem_.state().time), false);
  if (name == "strain_energy_density") return scalar(name, samples().strain_energy_density);
  if (name == "deformation_gradient") return tensor(name, samples().H, true);
  if (name == "first_piola") return tensor(name, samples().P, false);
  if (name == "cauchy") return tensor(name, samples().cauchy, false);
  if (name == "von_mises") return scalar(name, samples().von_mises);
  if (name == "damage") return scalar(name, problem_.terms().damage());
  if (name == "shape_tensor_condition") return scalar(name, problem_.terms().shape_tensor_condition());
  const std::size_t n = problem_.body().points();
  OutputField out{name, 1, std::vector<double>(n)};
  if (name == "jacobian") {
    const std::vector<double>& F = get("deformation_gradient").data;
    for (std::size_t p = 0; p < n; ++p) {
      const double* f = &F[9 * p];
      out.data[p] = f[0] * (f[4] * f[8] - f[5] * f[7]) - f[1] * (f[3] * f[8] - f[5] * f[6]) + f[2] * (f[3] * f[7] - f[4] * f[6]);
    }
    return out;
  }
  if (name == "material_id") {
    const auto ids = problem_.body().material_ids();
    for (std::size_t p = 0; p < n; ++p) out.data[p] = ids.empty() ? 0.0 : ids[static_cast<std::size_t>(problem_.body().internal()[p])];
    return out;
  }
  throw std::out_of_range("point field " + name);
}

}  // namespace perikit
