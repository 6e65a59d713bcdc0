#include "fracture/search/bond_energy_split.hpp"

#include <algorithm>

#include "terms/pairs/pair_energy_shares.hpp"

namespace perikit {

void energy_shares(const Formulation& formulation, int dimension, const FamilyArrays& family, AlignedVector<double>& share) {
  share.assign(family.size, 1.0);
  const bool by_bond = formulation.parts(dimension) == 0 && !formulation.pairs;
  if (by_bond && formulation.weight == BondWeight::volume) return;
  const AlignedVector<double>& omega = family.whole.empty() ? family.omega : family.whole;
  if (formulation.pairs)
    return pair_energy_shares(*formulation.pairs, family.bonds, family.length.data(), omega.data(), share.data());
  std::copy_n(omega.begin(), family.far.size(), share.begin());
}

}  // namespace perikit
