#include "fracture/search/bond_energy_split.hpp"

#include <algorithm>

#include "terms/pairs/pair_energy_shares.hpp"

namespace perikit {

void EnergyShares::of_point(std::size_t p, const FamilyArrays& family, AlignedVector<double>& share) const {
  without_factors(family, share);
  if (!factors_ || factors_->empty()) return;
  for (std::size_t k = 0; k < family.far.size(); ++k) share[k] *= factors_->of(families_, p, static_cast<std::size_t>(family.far[k]));
}

void EnergyShares::of_regular(const FamilyArrays& family, AlignedVector<double>& share) const {
  without_factors(family, share);
  for (std::size_t k = 0; k < family.far.size() && factors_; ++k) share[k] *= factors_->of_regular(k);
}

void EnergyShares::without_factors(const FamilyArrays& family, AlignedVector<double>& share) const {
  share.assign(family.size, 1.0);
  const bool by_bond = formulation_.parts(families_.body().dimension()) == 0 && !formulation_.pairs;
  if (by_bond && formulation_.weight == BondWeight::volume) return;
  const AlignedVector<double>& omega = family.whole.empty() ? family.omega : family.whole;
  if (formulation_.pairs)
    return pair_energy_shares(*formulation_.pairs, family.bonds, family.length.data(), omega.data(), share.data());
  std::copy_n(omega.begin(), family.far.size(), share.begin());
}

}  // namespace perikit
