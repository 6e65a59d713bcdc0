#pragma once
#include "families/bonds.hpp"
#include "families/family_arrays.hpp"
#include "perikit/body/body.hpp"

namespace perikit {

/// The stretch of a bond of a body at u.
double bond_stretch(const Body& body, ConstFieldView u, BondId bond) noexcept;
/// The same of bond k in the family of a point; equal bits from both ends.
double bond_stretch(const FamilyArrays& family, std::size_t k, std::size_t point, ConstFieldView u) noexcept;

}  // namespace perikit
