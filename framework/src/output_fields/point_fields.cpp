#include "output_fields/point_fields.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "families/families.hpp"
#include "perikit/core/communicator.hpp"
#include "perikit/problem/motion.hpp"
#include "problem/loose/pieces.hpp"

namespace perikit {

const std::vector<PointField>& point_fields() {
  using From = PointFields&;
  static const std::vector<PointField> all{
      {"displacement", 3, false, Sampling::nothing, "displacement", "m", [](From f) { return f.vector(f.problem_.state().displacement()); }},
      {"velocity", 3, false, Sampling::nothing, "velocity", "m/s",
       [](From f) { return f.vector(f.moves_ ? ConstFieldView(f.problem_.state().velocity()) : ConstFieldView()); }},
      {"acceleration", 3, false, Sampling::nothing, "acceleration", "m/s²", [](From f) { return f.acceleration(); }},
      {"internal_force", 3, false, Sampling::nothing, "internal force density", "N/m³",
       [](From f) { return f.vector(f.problem_.state().internal_force(), true); }},
      {"external_force", 3, false, Sampling::nothing, "external force density", "N/m³", [](From f) { return f.external_force(); }},
      {"reaction", 3, false, Sampling::nothing, "reaction", "N", [](From f) { return f.reaction(); }},
      {"strain_energy_density", 1, false, Sampling::energy, "strain energy density", "J/m³",
       [](From f) { return f.scalar(f.samples_->strain_energy_density); }},
      {"deformation_gradient", 9, false, Sampling::H, "deformation gradient", "", [](From f) { return f.tensor(f.samples_->H, true); }},
      {"first_piola", 9, false, Sampling::P, "first Piola-Kirchhoff stress", "Pa", [](From f) { return f.tensor(f.samples_->P); }},
      {"cauchy", 9, false, Sampling::cauchy, "Cauchy stress", "Pa", [](From f) { return f.tensor(f.samples_->cauchy); }},
      {"von_mises", 1, false, Sampling::von_mises, "von Mises stress", "Pa", [](From f) { return f.scalar(f.samples_->von_mises); }},
      {"jacobian", 1, false, Sampling::H, "jacobian", "", [](From f) { return f.jacobian(); }},
      {"damage", 1, false, Sampling::nothing, "damage", "",
       [](From f) { return f.scalar(f.once("damage", [&](Field) { return f.problem_.terms().damage(); })); }},
      {"shape_tensor_condition", 1, true, Sampling::nothing, "shape tensor condition", "",
       [](From f) { return f.scalar(f.once("shape_tensor_condition", [&](Field) { return f.problem_.terms().shape_tensor_condition(); })); }},
      {"material_id", 1, false, Sampling::nothing, "material id", "", [](From f) { return f.material_id(); }},
      {"fragment", 1, false, Sampling::nothing, "number of the piece", "", [](From f) { return f.scalar(f.piece_numbers()); }}};
  return all;
}

std::vector<std::string> point_field_names() {
  std::vector<std::string> names;
  for (const PointField& field : point_fields()) names.push_back(field.name);
  return names;
}

const PointField* find_point_field(std::string_view name) {
  const auto found = std::ranges::find(point_fields(), name, &PointField::name);
  return found == point_fields().end() ? nullptr : &*found;
}

std::vector<std::string> field_components(int width, int dimension) {
  std::vector<std::string> names;
  const std::string axes = "xyz";
  if (width == 3)
    for (const char a : axes.substr(0, static_cast<std::size_t>(dimension > 0 ? dimension : 3))) names.emplace_back(1, a);
  if (width == 9)
    for (const char a : axes)
      for (const char b : axes) names.push_back({a, b});
  return names;
}

int PointFields::column(int w, const std::string& component) {
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

std::vector<double> PointFields::vector(ConstFieldView field, bool per_volume) const {
  std::vector<double> out(3 * rows_.size(), 0.0);
  for (std::size_t p = 0; p < rows_.size(); ++p) {
    const auto i = static_cast<std::size_t>(rows_[p]);
    const double factor = per_volume ? 1.0 / problem_.points().volume(i) : 1.0;
    for (int c = 0; c < field.components && field.data; ++c)
      out[3 * p + static_cast<std::size_t>(c)] = factor * field.component(c)[i];
  }
  return out;
}

std::vector<double> PointFields::scalar(ConstFieldView field) const {
  std::vector<double> out(rows_.size());
  for (std::size_t p = 0; p < rows_.size(); ++p) out[p] = field.data[rows_[p]];
  return out;
}

std::vector<double> PointFields::tensor(ConstFieldView field, bool identity) const {
  const auto d = static_cast<std::size_t>(problem_.dimension());
  std::vector<double> out(9 * rows_.size(), 0.0);
  for (std::size_t p = 0; p < rows_.size(); ++p) {
    for (int c = 0; c < field.components; ++c) {
      const auto k = static_cast<std::size_t>(c);
      // In-space components row by row, then the other diagonal ones.
      const std::size_t at = field.components == 9 ? k : k < d * d ? 3 * (k / d) + k % d : 4 * (d + k - d * d);
      out[9 * p + at] = field.component(c)[rows_[p]];
    }
    for (std::size_t a = 0; a < 3 && identity; ++a) out[9 * p + 4 * a] += 1.0;
  }
  return out;
}

Sampling PointFields::samples_of(std::span<const std::string> names) {
  Sampling all = Sampling::nothing;
  for (const std::string& name : names)
    if (!names_state(name)) all = all | find_point_field(name)->samples;
  return all;
}

void PointFields::expect(std::span<const std::string> names) {
  const Sampling all = samples_of(names) | (samples_ ? samples_->asked : Sampling::nothing);
  if (all == Sampling::nothing || (samples_ && samples_->asked == all)) return;
  problem_.sample(samples_.emplace(PointSamples{.asked = all}));
}

const OutputField& PointFields::get(const std::string& name) {
  if (const auto known = cache_.find(name); known != cache_.end()) return known->second;
  return cache_[name] = at(name, problem_.points().owned());
}

OutputField PointFields::at(const std::string& name, std::span<const std::int32_t> points) {
  if (names_state(name)) return state(name, points);
  const PointField* field = find_point_field(name);
  if (!field) throw std::out_of_range("point field " + name);
  expect({&name, 1});
  rows_ = points;
  return {name, field->width, field->compute(*this)};
}

OutputField PointFields::state(const std::string& name, std::span<const std::int32_t> points) {
  const Laws& laws = problem_.laws();
  std::vector<const Material*> materials;
  for (const MaterialRecord& record : laws.records()) materials.push_back(record.material.get());
  const std::vector<StateField> all = state_fields(materials, laws.space());
  const auto field = std::ranges::find(all, name, &StateField::name);
  if (field == all.end() || field->width == 0) throw std::out_of_range("point field " + name);
  const auto components = static_cast<std::size_t>(field->components);
  std::vector<double> values(components * points.size());
  problem_.terms().average_state(variable_of(name), components, points, values);
  if (field->width == 1) return {name, 1, std::move(values), field->unit};
  OutputField out{name, field->width, std::vector<double>(9 * points.size()), field->unit};
  for (std::size_t p = 0; p < points.size(); ++p) write_row(laws.space(), std::span(values).subspan(p * components, components), &out.data[9 * p]);
  return out;
}

std::vector<double> PointFields::acceleration() {
  return vector(once("acceleration", [&](Field) { return dynamic_ ? accelerations(problem_, problem_.state().time) : problem_.make_field(); }));
}

std::vector<double> PointFields::reaction() {
  return vector(once("reaction", [&](Field before) { return reactions(problem_, dynamic_, problem_.state().time, std::move(before)); }));
}

std::vector<double> PointFields::external_force() const {
  return vector(problem_.loads().any() ? ConstFieldView(problem_.state().external_force()) : ConstFieldView(), true);
}

std::vector<double> PointFields::jacobian() const {
  const std::vector<double> F = tensor(samples_->H, true);
  std::vector<double> out(F.size() / 9);
  for (std::size_t p = 0; p < out.size(); ++p) {
    const double* f = &F[9 * p];
    out[p] = f[0] * (f[4] * f[8] - f[5] * f[7]) - f[1] * (f[3] * f[8] - f[5] * f[6]) + f[2] * (f[3] * f[7] - f[4] * f[6]);
  }
  return out;
}

const Field& PointFields::piece_numbers() {
  const auto version = static_cast<std::int64_t>(problem_.families().version());
  if (communicator().largest(version != pieces_of_ ? 1 : 0) > 0) pieces_ = perikit::piece_numbers(problem_.families(), problem_);
  pieces_of_ = version;
  return pieces_;
}

const CrackAreas& PointFields::crack_areas() {
  if (!crack_areas_) crack_areas_.emplace(problem_.families());
  return *crack_areas_;
}

std::vector<double> PointFields::material_id() const {
  const auto ids = problem_.body().material_ids();
  std::vector<double> out(rows_.size());
  for (std::size_t p = 0; p < out.size(); ++p) out[p] = ids.empty() ? 0.0 : ids[static_cast<std::size_t>(rows_[p])];
  return out;
}

}  // namespace perikit
