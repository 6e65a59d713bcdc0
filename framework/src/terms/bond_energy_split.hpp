#pragma once
/// What bonds store in a homogeneous expansion of their family, relative to each other: BondStates::share.

#include "families/family_arrays.hpp"
#include "model/formulation.hpp"

namespace perikit {

/// Of n bonds of a pair law, from arrays that can be read up to padded(n); share is written so far too.
void pair_energy_shares(const PairKinematics& law, int n, const double* length, const double* omega, double* share) noexcept;

/// Of the bonds of a loaded family, in a body of this dimension; padded.
void energy_shares(const Formulation& formulation, int dimension, const FamilyArrays& family, AlignedVector<double>& share);

}  // namespace perikit
