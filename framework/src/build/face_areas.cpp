#include <algorithm>

#include "build/face_shares.hpp"
#include "build/materials.hpp"
#include "families/families.hpp"

namespace perikit {

namespace {

/// P = (H + H^T)/2: unit stress for unit strain, no lateral contraction.
class UnitMaterial final : public Material {
 public:
  MaterialTraits traits() const noexcept override { return {.constant_tangent = true, .objective = false}; }
  void constants(const MaterialInput&, double*) const override {}
  Moduli small_strain(const double*) const noexcept override { return {0, 0.5}; }
  Status evaluate(Space space, const MaterialBatch& batch) const noexcept override {
    const int d = dimension(space);
    const auto stress = [&](const double* H, double* P) {
      for (int a = 0; a < d; ++a)
        for (int b = 0; b < d; ++b)
          for (int p = 0; p < batch.n; ++p) {
            const auto at = [&](int r, int c) {
              return static_cast<std::size_t>(r * d + c) * batch.stride + static_cast<std::size_t>(p);
            };
            P[at(a, b)] = 0.5 * (H[at(a, b)] + H[at(b, a)]);
          }
      for (int c = d * d; c < tensor_components(space); ++c)
        std::fill_n(P + static_cast<std::size_t>(c) * batch.stride, batch.n, 0.0);
    };
    if (batch.P) stress(batch.H, batch.P);
    if (batch.dP) stress(batch.dH, batch.dP);
    return {};
  }
};

}  // namespace

Field face_areas(TermParts parts, int axis) {
  const Body& body = parts.families->body();
  MaterialRecord record;
  record.material = std::make_shared<UnitMaterial>();
  record.traits = record.material->traits();
  record.constants.resize(1);
  std::vector<MaterialRecord> records;
  records.push_back(std::move(record));
  std::vector<std::uint16_t> ids;   // images and far points store nothing here either
  if (!body.places().place.empty()) {
    const Laws& known = *parts.laws;
    for (const bool far : {false, true}) {
      records.push_back(silent_record());
      records.back().far = far;
    }
    ids.assign(body.stride(), 0);
    for (const std::int32_t index : body.internal()) {
      const auto p = static_cast<std::size_t>(index);
      ids[p] = known.far(p) ? 2 : known.record_of(p).silent ? 1 : 0;
    }
  } else if (body.owned().size() < body.points()) {
    records.push_back(silent_record());
    ids.assign(body.stride(), 1);
    for (const std::int32_t p : body.owned()) ids[static_cast<std::size_t>(p)] = 0;
  }
  const Laws laws(body.space(), std::move(records), ids, body.stride());
  parts.laws = &laws;
  parts.stabilization = nullptr;  // a homogeneous deformation has no zero-energy part
  parts.damage = nullptr;
  parts.interfaces = nullptr;  // one law on both sides
  parts.skip = parts.share = true;
  Terms terms(parts);   // over the families that are there
  const Field rest = body.make_field(body.dimension());
  Field stretch = body.make_field(body.dimension()), areas = body.make_field(body.dimension()), area = body.make_field(1);
  for (const std::int32_t p : body.internal())
    stretch.component(axis)[p] = body.position(static_cast<std::size_t>(p))[static_cast<std::size_t>(axis)];
  if (terms.tangent(rest, stretch, areas).ok()) std::copy_n(areas.component(axis), body.stride(), area.data());
  return area;
}

}  // namespace perikit
