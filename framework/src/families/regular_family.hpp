#pragma once
#include "families/families.hpp"

namespace perikit {

/// A whole family of a regular lattice with the spacing, the horizon and the influence of these families.
FamilyArrays regular_family(const Families& families);

}  // namespace perikit
