#include "terms/penalty/zero_energy_penalty.hpp"

#include "core/dimension.hpp"
#include "terms/penalty/penalty_assembly.hpp"

namespace perikit {

void ZeroEnergyPenalty::take(std::size_t p, double energy, const Wanted& wanted) const {
  if (wanted.energies) wanted.energies[p / padding].stored += energy;
  if (!wanted.screen) return;
  const Families& families = parts_.families;
  const double left = families.body().volume(p) * (1 - families.damage(p));
  if (energy > left * wanted.screen->density[p]) wanted.screen->mark(p);
}

/// The penalty of a point belongs to its bonds as the rest of its energy does. It is no stress.
void ZeroEnergyPenalty::add_bonds(const Configuration& at, const Region& region, BondSamples& samples) {
  if (samples.what() == BondSampling::derivative) return;  // fracture/search/bond_release.hpp knows what it does
  const Body& body = parts_.families.body();
  Field density = body.make_field(1);
  add_density(at.u(), density.data(), region.only());
  for (const std::int32_t p : body.internal()) {
    const auto i = static_cast<std::size_t>(p);
    if (marked(*region.evaluated, i)) samples.add({p, -1, 0.0, density.data()[i] * body.volume(i)});
  }
}

std::unique_ptr<Assembly> ZeroEnergyPenalty::make_assembly(const BlockRows& rows) {
  return with_dimension(rows.body().dimension(), [&](auto d) -> std::unique_ptr<Assembly> { return std::make_unique<PenaltyAssembly<d>>(parts_, rows); });
}

void ZeroEnergyPenalty::report(ModelReport& report) const {
  report.bytes += bytes();
  if (parts_.formulation.order > 1 && !whole_fit(parts_)) return;
  report.skips.push_back({"adjoint of the penalty through the point gradient", "it vanishes: sum of omega z q(xi) V = 0 for each monomial of the fit (same omega)",
                          "a gradient and a divergence"});
}

std::unique_ptr<Term> make_penalty(const PenaltyParts& parts) {
  return with_dimension(parts.families.body().dimension(), [&](auto d) {
    if (whole_fit(parts) && parts.families.lattice()) return make_lattice_fit_penalty<d>(parts);
    if (parts.formulation.order > 1) return make_stencil_penalty<d>(parts);
    return parts.families.lattice() ? make_lattice_penalty<d>(parts) : make_cloud_penalty<d>(parts);
  });
}

}  // namespace perikit
