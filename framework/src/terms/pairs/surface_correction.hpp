#pragma once
#include "families/families.hpp"
#include "families/family_arrays.hpp"
#include "perikit/model/kinematics.hpp"
#include "perikit/operators/laws.hpp"

namespace perikit {

/// m = sum omega |xi|^2 V over what is left of the bonds, or over whole ones.
double weighted_volume(const FamilyArrays& family, bool whole);

/// What bonds near surfaces are multiplied with: by axis, the stiffness of a whole family of a regular lattice against a
/// homogeneous stretch along it over that of the family of the point. A bond takes the mean of both ends in its direction.
template <int D>
Field surface_correction(const Families& families, const PairKinematics& law, const Laws& laws);

}  // namespace perikit
