#pragma once
/// What bonds store in a homogeneous expansion of their family, relative to each other: BondStates::share.

#include "families/family_arrays.hpp"
#include "model/formulation.hpp"

namespace perikit {

/// Of the bonds of a loaded family, in a body of this dimension; padded.
void energy_shares(const Formulation& formulation, int dimension, const FamilyArrays& family, AlignedVector<double>& share);

}  // namespace perikit
