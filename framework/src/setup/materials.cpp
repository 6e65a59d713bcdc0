#include "setup/materials.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "perikit/core/field.hpp"
#include "perikit/core/warnings.hpp"
#include "setup/numeric_values.hpp"

namespace perikit {

namespace {

/// Ghosts and images store nothing: the energy of their evaluation points is that of the rank that owns them, or of their sources.
class SilentMaterial final : public Material {
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

/// out <- the constants of the law at x. Throws InputError.
void constants_at(const Point& x, const PartValues& part, const NumericValues& values, const MaterialRecord& record, double* out) {
  const MaterialInput input{[&](std::string_view key) { return values.contains(key); },
                            [&](std::string_view key) { return values.find(key)->second(x); }};
  const auto where = [&] { return record.uniform ? std::string() : fmt::format(", at ({:.6g}, {:.6g}, {:.6g})", x[0], x[1], x[2]); };
  make_constants(part, "material", values, where, [&] { record.material->constants(input, out); });
}

void fill_varying(MaterialRecord& record, const PartValues& part, const NumericValues& values, const Body& body, std::size_t id) {
  const auto count = static_cast<std::size_t>(record.traits.constants);
  const std::size_t stride = body.stride();
  const auto ids = body.material_ids();
  const auto density = values.find("density");
  record.constants.assign(count * stride, 0.0);
  if (density != values.end()) record.densities.assign(stride, 0.0);
  std::vector<double> one(std::max<std::size_t>(count, 1));
  auto any = static_cast<std::size_t>(body.internal().front());
  for (const std::int32_t index : body.internal()) {
    const auto p = static_cast<std::size_t>(index);
    if (!ids.empty() && ids[p] != id) continue;
    constants_at(body.position(p), part, values, record, one.data());
    any = p;
    for (std::size_t k = 0; k < count; ++k) record.constants[k * stride + p] = one[k];
    if (density != values.end()) record.densities[p] = density->second(body.position(p));
  }
  // Padding and points of other materials see admissible constants too.
  for (std::size_t p = 0; p < stride; ++p) {
    if (body.alive(p) && (ids.empty() || ids[p] == id)) continue;
    for (std::size_t k = 0; k < count; ++k) record.constants[k * stride + p] = record.constants[k * stride + any];
  }
}

MaterialRecord build_record(const PartValues& part, const Scene& scene, const PartFactory& factory, const Body& body,
                            std::size_t id) {
  MaterialRecord record;
  record.material = factory.material(part);
  record.traits = record.material->traits();
  const NumericValues values = numeric_values(part, scene.constants, false);
  record.uniform = std::ranges::none_of(values, [](const auto& entry) { return entry.second.depends_on_position(); });
  if (!record.uniform) {
    fill_varying(record, part, values, body, id);
    return record;
  }
  record.constants.resize(std::max<std::size_t>(static_cast<std::size_t>(record.traits.constants), 1));
  constants_at({}, part, values, record, record.constants.data());
  if (const auto density = values.find("density"); density != values.end()) record.density = density->second({});
  return record;
}

/// Whether the stress falls in a stretch that grows in steps, at constant volume.
bool softens(const Material& material, const std::vector<double>& constants) {
  Field H(9, padding), P(9, padding), begin(material.state_components(Space::solid), padding), end(begin.components(), padding), given(static_cast<int>(constants.size()), padding);
  for (std::size_t k = 0; k < constants.size(); ++k)
    for (std::size_t l = 0; l < padding; ++l) given.component(static_cast<int>(k))[l] = constants[k];
  double before = 0;
  for (double strain = 1e-4; strain < 1; strain *= 1.1) {
    H.component(0)[0] = std::expm1(strain);
    H.component(4)[0] = H.component(8)[0] = std::expm1(-0.5 * strain);
    MaterialBatch batch{.n = 1, .stride = padding, .H = H.data(), .constants = given.data(), .constant_stride = padding};
    batch.state_old = begin.data(), batch.state_new = end.data(), batch.state_stride = padding, batch.P = P.data();
    if (!material.evaluate(Space::solid, batch).ok()) return false;
    const double stress = P.component(0)[0] * std::exp(strain) - P.component(4)[0] * std::exp(-0.5 * strain);
    if (stress < before * (1 - 1e-9)) return true;
    before = stress;
    std::swap(begin, end);
  }
  return false;
}

}  // namespace

std::vector<std::string> softening(const Scene& scene, const Body& body, const Laws& laws) {
  constexpr std::size_t samples = 64;   // of constants that vary in place
  std::vector<std::string> warnings;
  const auto parts = materials(scene);
  for (std::size_t id = 0; id < parts.size(); ++id) {
    const MaterialRecord& record = laws.records()[id];
    if (record.material->state_components(Space::solid) == 0) continue;
    const auto count = static_cast<std::size_t>(record.traits.constants);
    bool found = record.uniform && softens(*record.material, {record.constants.begin(), record.constants.begin() + static_cast<std::ptrdiff_t>(count)});
    const auto points = body.owned();
    for (std::size_t i = 0; !record.uniform && !found && i < points.size(); i += std::max<std::size_t>(points.size() / samples, 1)) {
      const auto p = static_cast<std::size_t>(points[i]);
      if (!body.material_ids().empty() && body.material_ids()[p] != id) continue;
      std::vector<double> one(count);
      for (std::size_t k = 0; k < count; ++k) one[k] = record.constants[k * body.stride() + p];
      found = softens(*record.material, one);
    }
    if (found)
      warnings.push_back(named("softening", fmt::format("the material \"{}\" softens, and has no length of its own: strains gather in bands whose width follows from the horizon and the spacing, so that what the "
                                                        "body carries beyond its largest load, and what it dissipates, depend on both",
                                                        parts[id]->type)));
  }
  return warnings;
}

std::vector<std::shared_ptr<const PartValues>> materials(const Scene& scene) {
  std::vector<std::shared_ptr<const PartValues>> parts{scene.material};
  for (const RegionDescription& region : scene.regions) parts.push_back(region.material);
  return parts;
}

MaterialRecord silent_record() {
  MaterialRecord record;
  record.material = std::make_shared<SilentMaterial>();
  record.silent = true;
  record.traits = record.material->traits();
  record.constants.resize(1);
  return record;
}

std::unique_ptr<Laws> build_laws(const Scene& scene, const PartFactory& factory, const Body& body, bool images) {
  std::vector<MaterialRecord> records;
  for (const auto& part : materials(scene)) records.push_back(build_record(*part, scene, factory, body, records.size()));
  if (images) records.push_back(silent_record());
  if (!body.places().place.empty()) {
    records.push_back(silent_record());
    records.back().incomplete = true;
  }
  return std::make_unique<Laws>(body.space(), std::move(records), body.material_ids(), body.stride());
}

std::optional<InputError> missing_density(const Scene& scene, const Body& body, const Laws& laws) {
  for (const std::int32_t index : body.owned()) {
    const auto p = static_cast<std::size_t>(index);
    const double density = laws.density(p);
    if (density > 0) continue;
    const ParameterValues& values = materials(scene)[body.material_ids().empty() ? 0 : body.material_ids()[p]]->values;
    if (!values.has("density"))
      return values.error("density", "found nothing; allowed: a density > 0 [kg/m^3], which dynamic runs and columns of masses need");
    const Point x = body.position(p);
    return values.error("density", fmt::format("found {} at ({:.6g}, {:.6g}, {:.6g}); allowed: a density > 0 [kg/m^3]", density,
                                               x[0], x[1], x[2]));
  }
  return std::nullopt;
}

}  // namespace perikit
