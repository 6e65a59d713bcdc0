#pragma once
/// Classes of equal families on a lattice: the same intact slots and the same normaliser of bond weights.

#include <cstdint>
#include <vector>

#include "families/lattice/lattice_families.hpp"

namespace perikit {

struct FamilyClass {
  std::vector<std::uint16_t> slots;
  std::vector<std::int32_t> shifts;  ///< by bond: the far end lies so far on in memory
  double scale = 0;                  ///< V_i / N_i of bond weights
  std::size_t members = 0;
};

struct EqualFamilies {
  EqualFamilies(const LatticeFamilies& families, BondWeight weight);
  std::vector<FamilyClass> classes;    ///< 0: the whole family
  std::vector<std::int32_t> of_point;  ///< by internal index; -1: no point there
};

}  // namespace perikit
