#include "output_fields/crack_areas.hpp"

#include <numbers>

#include "families/families.hpp"

namespace perikit {

CrackAreas::CrackAreas(const Families& families) : families_(&families), factors_(families.body().stride(), 0.0) {
  const Body& body = families.body();
  const double mean_cosine = body.dimension() == 1 ? 1 : body.dimension() == 2 ? 2 / std::numbers::pi : 0.5;
  FamilyArrays family;
  const auto each_bond = [&](BondsOf which, std::size_t p, auto&& use) {
    families.load(p, which, family);
    for (std::size_t k = 0; k < static_cast<std::size_t>(family.bonds); ++k)
      use(family.whole_omega(k) * family.volume[k], family.length[k]);
  };
  families.each_class([&](std::span<const std::int32_t> points) {
    for (const std::int32_t index : points) {
      const auto p = static_cast<std::size_t>(index);
      if (!body.owns(p) || body.image(p)) continue;
      double lengths = 0, left = 0;
      each_bond(BondsOf::uncut, p, [&](double weight, double length) { lengths += weight * length; });
      each_bond(BondsOf::set_up, p, [&](double weight, double) { left += weight; });
      if (lengths > 0) factors_[p] = body.volume(p) * left / (mean_cosine * lengths);
    }
  });
}

double CrackAreas::of(std::size_t p) const { return factors_[p] * (1 - families_->remaining_influence(p)); }

}  // namespace perikit
