#pragma once
/// What bonds store in a homogeneous expansion of their family, relative to each other: BondStates::share.

#include "families/family_arrays.hpp"
#include "model/formulation.hpp"
#include "terms/pairs/bond_factors.hpp"

namespace perikit {

class EnergyShares {
 public:
  /// factors: of the bonds of a pair law; null: none. What is given must outlive them.
  EnergyShares(const Formulation& formulation, const Families& families, const BondFactors* factors) : formulation_(formulation), families_(families), factors_(factors) {}

  /// Of the bonds of the family of p as it is loaded; padded.
  void of_point(std::size_t p, const FamilyArrays& family, AlignedVector<double>& share) const;
  /// Of those of a whole family of a regular lattice.
  void of_regular(const FamilyArrays& family, AlignedVector<double>& share) const;

 private:
  void without_factors(const FamilyArrays& family, AlignedVector<double>& share) const;

  const Formulation& formulation_;
  const Families& families_;
  const BondFactors* factors_;
};

}  // namespace perikit
