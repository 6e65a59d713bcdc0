#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "perikit/output/recorder.hpp"
#include "perikit/problem/body_problem.hpp"

namespace perikit {

namespace {

/// Ghosts store nothing: the energy of their evaluation points is that of the rank that owns them.
class GhostMaterial final : public Material {
 public:
  MaterialTraits traits() const noexcept override { return {.constant_tangent = true}; }
  void constants(const MaterialInput&, double*) const override {}
  Moduli small_strain(const double*) const noexcept override { return {}; }
  Status evaluate(Space space, const MaterialBatch& batch) const noexcept override {
    const auto zero = [&](double* x, int components) {
      for (int c = 0; x && c < components; ++c) std::fill_n(x + static_cast<std::size_t>(c) * batch.stride, batch.n, 0.0);
    };
    const int n = tensor_components(space);
    zero(batch.psi, 1);
    zero(batch.P, n);
    zero(batch.dP, n);
    zero(batch.A, n * n);
    zero(batch.lateral, 1);
    return {};
  }
};

MaterialRecord ghost_record() {
  MaterialRecord record;
  record.material = std::make_shared<GhostMaterial>();
  record.traits = record.material->traits();
  record.constants.resize(1);
  return record;
}

}  // namespace

void BodyProblem::read_materials(const PartFactory& factory) {
  std::vector<MaterialRecord> records;
  std::vector<std::shared_ptr<const PartValues>> parts{scene_.material};
  for (const RegionDescription& region : scene_.regions) parts.push_back(region.material);
  for (std::size_t id = 0; id < parts.size(); ++id) {
    const PartValues& part = *parts[id];
    MaterialRecord record;
    record.material = factory.material(part);
    record.traits = record.material->traits();
    // Expression-valued parameters are kept as texts; everything numeric becomes an Expression too, so that there is one path.
    std::map<std::string, Expression, std::less<>> values;
    for (const std::string& key : part.values.keys()) {
      const ParameterValue* value = part.values.find(key);
      const std::string path = part.values.path() + "." + key;
      if (const auto* number = std::get_if<double>(value)) values.emplace(key, Expression(*number));
      else if (const auto* text = std::get_if<std::string>(value); text && part.values.is_expression(key)) {
        Expression expression(*text, scene_.constants, false, part.values.position(key), path);
        record.uniform = record.uniform && !expression.depends_on_position();
        values.emplace(key, std::move(expression));
      }
    }
    const auto at = [&](const Point& x, double* out) {
      const MaterialInput input{[&](std::string_view key) { return values.contains(key); },
                                [&](std::string_view key) { return values.find(key)->second(x); }};
      try {
        record.material->constants(input, out);
      } catch (const std::domain_error& error) {
        // The law speaks of the parameter as it knows it: "found NAME = ...".
        const std::string text = record.uniform ? std::string(error.what())
                                                : fmt::format("{}, at ({:.6g}, {:.6g}, {:.6g})", error.what(), x[0], x[1], x[2]);
        for (const auto& [key, value] : values)
          if (text.starts_with(fmt::format("found {} = ", key))) throw part.values.error(key, text);
        throw InputError(part.values.position(""), part.values.path(), text);
      }
    };
    const auto count = static_cast<std::size_t>(record.traits.constants);
    const auto density = values.find("density");
    if (record.uniform) {
      record.constants.resize(std::max<std::size_t>(count, 1));
      at({}, record.constants.data());
      if (density != values.end()) record.density = density->second({});
    } else {
      record.constants.assign(count * stride(), 0.0);
      if (density != values.end()) record.densities.assign(stride(), 0.0);
      std::vector<double> one(std::max<std::size_t>(count, 1));
      auto any = static_cast<std::size_t>(body_.internal().front());
      for (const std::int32_t index : body_.internal()) {
        const auto p = static_cast<std::size_t>(index);
        if (!body_.material_ids().empty() && body_.material_ids()[p] != id) continue;
        at(body_.position(p), one.data());
        any = p;
        for (std::size_t k = 0; k < count; ++k) record.constants[k * stride() + p] = one[k];
        if (density != values.end()) record.densities[p] = density->second(body_.position(p));
      }
      // Padding and points of other materials see admissible constants too.
      for (std::size_t p = 0; p < stride(); ++p) {
        if (body_.alive(p) && (body_.material_ids().empty() || body_.material_ids()[p] == id)) continue;
        for (std::size_t k = 0; k < count; ++k) record.constants[k * stride() + p] = record.constants[k * stride() + any];
      }
    }
    records.push_back(std::move(record));
  }
  if (partition_) records.push_back(ghost_record());
  laws_ = std::make_unique<Laws>(body_.space(), std::move(records), body_.material_ids(), stride());
}

void BodyProblem::read_initial() {
  const auto fill = [&](const std::vector<std::optional<Expression>>& values, FieldView field) {
    for (std::size_t c = 0; c < values.size(); ++c) {
      for (const std::int32_t p : body_.owned()) {
        field.component(static_cast<int>(c))[p] = (*values[c])(body_.position(static_cast<std::size_t>(p)));
      }
    }
  };
  if (scene_.initial_from) {
    const LoadedFrame frame = read_last_frame(*scene_.initial_from, points());
    const auto copy = [&](const std::string& name, FieldView field) {
      const OutputField& from = frame.fields.at(name);
      for (const std::int32_t p : body_.owned()) {
        const auto place = static_cast<std::size_t>(body_.input_of(static_cast<std::size_t>(p)));
        const std::size_t row = partition_ ? static_cast<std::size_t>(partition_->input(place)) : place;
        for (int c = 0; c < dimension(); ++c) field.component(c)[p] = from.data[3 * row + static_cast<std::size_t>(c)];
      }
    };
    if (!frame.fields.contains("displacement")) throw InputError(fmt::format("{}: the last frame has no displacement", scene_.initial_from->string()));
    copy("displacement", displacement_);
    if (frame.fields.contains("velocity")) copy("velocity", velocity());
  }
  if (!scene_.initial_displacement.empty()) fill(scene_.initial_displacement, displacement_);
  if (!scene_.initial_velocity.empty()) fill(scene_.initial_velocity, velocity());
}

}  // namespace perikit
