#include "setup/surfaces/pair_areas.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>

#include "body/partition/near_ranks.hpp"
#include "families/families.hpp"
#include "perikit/core/exact_sum.hpp"
#include "perikit/core/rank_values.hpp"
#include "setup/materials.hpp"
#include "setup/surfaces/free_surface.hpp"

namespace perikit {

namespace {

/// A law of which only the small strain counts.
class SmallStrain final : public Material {
 public:
  explicit SmallStrain(Moduli moduli) : moduli_(moduli) {}
  MaterialTraits traits() const noexcept override { return {.constant_tangent = true}; }
  void constants(const MaterialInput&, double*) const override {}
  Moduli small_strain(const double*) const noexcept override { return moduli_; }
  Status evaluate(Space, const MaterialBatch&) const noexcept override { return {}; }

 private:
  Moduli moduli_;
};

/// Those of [material]; where they vary, their mean over the body. All ranks must call it.
Moduli moduli_of_material(const Body& body, const Laws& laws) {
  const MaterialRecord& record = laws.records().front();
  if (record.uniform) return record.material->small_strain(record.constants.data());
  ExactSum lambda, mu;
  for (const std::int32_t p : body.owned()) {
    const Moduli here = laws.moduli(static_cast<std::size_t>(p));
    lambda.add(here.lambda);
    mu.add(here.mu);
  }
  const auto points = static_cast<double>(body.points_of_all_ranks());
  return {total_of(body, lambda) / points, total_of(body, mu) / points};
}

/// About so many points at most, as far inside of the body as there are any: where their families and those of everything in these are whole, or nearly so
/// in thin bodies. All ranks must call it.
constexpr std::int64_t most_inner_points = 2000;

std::vector<std::int32_t> inner_points(const Body& body) {
  const std::int64_t every = body.points_of_all_ranks() / most_inner_points + 1;
  std::vector<SurfacePoint> surface;
  for (const std::int32_t p : free_surface(body)) surface.push_back({body.position(static_cast<std::size_t>(p)), 1});
  std::vector<std::int32_t> points;
  std::ranges::copy_if(body.owned(), std::back_inserter(points), [&](std::int32_t p) { return body.number(static_cast<std::size_t>(p)) % every == 0; });
  for (const double depth : {2.0, 1.5, 1.0, 0.5}) {   // in horizons
    std::vector<std::uint8_t> inner(body.stride(), 0);
    for (const std::int32_t p : points) inner[static_cast<std::size_t>(p)] = 1;
    const auto chosen = [&](std::int32_t p) { return inner[static_cast<std::size_t>(p)] != 0; };
    for (const PointBelow& point : points_below(body, surface, depth * body.horizon(), nullptr, chosen)) inner[static_cast<std::size_t>(point.p)] = 0;
    std::vector<std::int32_t> found;
    std::ranges::copy_if(points, std::back_inserter(found), chosen);
    if (counted(std::ssize(found)).all > 0) return found;
  }
  return points;
}

/// Of the values of all ranks. All ranks must call it.
double median(const std::vector<double>& mine) {
  std::vector<double> all = told_to_all(gathered(std::span<const double>(mine)));
  std::ranges::sort(all);
  return all[all.size() / 2];
}

}  // namespace

OneLaw::OneLaw(const Body& body, const Laws& known, MaterialRecord record) {
  std::vector<MaterialRecord> records;
  records.push_back(std::move(record));
  if (!body.places().place.empty()) {
    for (const bool far : {false, true}) {
      records.push_back(silent_record());
      records.back().incomplete = far;
    }
    ids_.assign(body.stride(), 0);
    for (const std::int32_t index : body.internal()) {
      const auto p = static_cast<std::size_t>(index);
      ids_[p] = known.incomplete(p) ? 2 : known.record_of(p).silent ? 1 : 0;
    }
  } else if (body.owned().size() < body.points()) {
    records.push_back(silent_record());
    ids_.assign(body.stride(), 1);
    for (const std::int32_t p : body.owned()) ids_[static_cast<std::size_t>(p)] = 0;
  }
  laws_ = std::make_unique<const Laws>(body.space(), std::move(records), ids_, body.stride());
}

Field pair_areas(TermParts parts, int axis) {
  const Body& body = parts.families->body();
  const int d = body.dimension();
  MaterialRecord record;
  record.material = std::make_shared<SmallStrain>(moduli_of_material(body, *parts.laws));
  record.traits = record.material->traits();
  record.constants.resize(1);
  const OneLaw law(body, *parts.laws, std::move(record));
  parts.laws = &law.laws();
  parts.interfaces = nullptr;
  parts.further.clear();
  parts.skip = parts.share = true;
  Terms terms(parts);
  const auto strained = [&](const std::function<double(int)>& strain) {
    Field u = body.make_field(d);
    for (const std::int32_t p : body.internal())
      for (int c = 0; c < d; ++c) u.component(c)[p] = strain(c) * body.position(static_cast<std::size_t>(p))[static_cast<std::size_t>(c)];
    return u;
  };
  // Energies of small strains, mean of both signs.
  const std::vector<std::int32_t> inner = inner_points(body);
  constexpr double small = 0x1p-16;
  const auto energy = [&](int along) {
    std::vector<double> twice(inner.size(), 0.0);
    for (const double sign : {1.0, -1.0}) {
      PointSamples samples{.asked = Sampling::energy};
      if (!terms.sample({strained([&](int c) { return along < 0 || c == along ? sign * small : 0.0; }), 0}, samples).ok()) continue;
      for (std::size_t k = 0; k < inner.size(); ++k) twice[k] += samples.strain_energy_density.data()[inner[k]];
    }
    return median(twice) / (small * small);
  };
  const double all_around = energy(-1);   // d (C_1111 + (d - 1) C_1122)
  double stress = all_around / d, lateral = 1;
  if (axis >= 0 && d > 1) {
    const double along = energy(axis), across = (stress - along) / (d - 1);   // C_1111, C_1122
    lateral = -across / (along + (d - 2) * across);
    stress = along + (d - 1) * lateral * across;
  }
  const Field rest = body.make_field(d), strain = strained([&](int c) { return axis < 0 || c == axis ? 1.0 : lateral; });
  Field areas = body.make_field(d);
  if (!terms.tangent({rest, 0}, strain, areas).ok()) areas.fill(0);
  for (int c = 0; c < d; ++c)
    for (const std::int32_t p : body.internal()) areas.component(c)[p] /= stress;
  return areas;
}

}  // namespace perikit
