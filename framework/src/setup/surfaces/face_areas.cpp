#include <algorithm>

#include "families/families.hpp"
#include "setup/surfaces/face_shares.hpp"
#include "setup/surfaces/pair_areas.hpp"

namespace perikit {

namespace {

/// Along an axis P = (H + H^T)/2: unit stress for unit strain, no lateral contraction. All around P = H_xx I, across the plane of the body too.
class UnitMaterial final : public Material {
 public:
  explicit UnitMaterial(UnitStress unit) : unit_(unit) {}
  MaterialTraits traits() const noexcept override { return {.constant_tangent = true, .objective = false}; }
  void constants(const MaterialInput&, double*) const override {}
  Moduli small_strain(const double*) const noexcept override { return {0, 0.5}; }
  Status evaluate(Space space, const MaterialBatch& batch) const noexcept override {
    const int d = dimension(space);
    const auto stress = [&](const double* H, double* P) {
      const auto at = [&](int component, int p) { return static_cast<std::size_t>(component) * batch.stride + static_cast<std::size_t>(p); };
      for (int c = 0; c < tensor_components(space); ++c) {
        const bool inside = c < d * d, diagonal = !inside || c % (d + 1) == 0;
        for (int p = 0; p < batch.n; ++p) {
          if (unit_ == UnitStress::all_around) P[at(c, p)] = diagonal ? H[at(0, p)] : 0.0;
          else P[at(c, p)] = inside ? 0.5 * (H[at(c, p)] + H[at(c % d * d + c / d, p)]) : 0.0;
        }
      }
    };
    if (batch.P) stress(batch.H, batch.P);
    if (batch.dP) stress(batch.dH, batch.dP);
    return {};
  }

 private:
  UnitStress unit_;
};

}  // namespace

Field face_areas(TermParts parts, int axis, UnitStress unit) {
  const Body& body = parts.families->body();
  if (parts.formulation.pairs) {
    const Field areas = pair_areas(std::move(parts), unit == UnitStress::all_around ? -1 : axis);
    Field area = body.make_field(1);
    std::copy_n(areas.component(axis), body.stride(), area.data());
    return area;
  }
  MaterialRecord record;
  record.material = std::make_shared<UnitMaterial>(unit);
  record.traits = record.material->traits();
  record.constants.resize(1);
  const OneLaw law(body, *parts.laws, std::move(record));
  parts.laws = &law.laws();
  parts.stabilization = nullptr;  // a homogeneous deformation has no zero-energy part
  parts.interfaces = nullptr;  // one law on both sides
  parts.further.clear();       // they have no stress
  parts.skip = parts.share = true;
  Terms terms(parts);   // over the families that are there
  const Field rest = body.make_field(body.dimension());
  Field stretch = body.make_field(body.dimension()), areas = body.make_field(body.dimension()), area = body.make_field(1);
  const auto strain_along = [&](int c) {
    for (const std::int32_t p : body.internal())
      stretch.component(c)[p] = body.position(static_cast<std::size_t>(p))[static_cast<std::size_t>(c)];
  };
  strain_along(axis);
  if (unit == UnitStress::all_around)
    for (int c = 0; c < body.dimension(); ++c) strain_along(c);
  if (terms.tangent({rest, 0}, stretch, areas).ok()) std::copy_n(areas.component(axis), body.stride(), area.data());
  return area;
}

}  // namespace perikit
