#pragma once
/// The evaluation points of one point for local force states: stencils and weights, bond by bond.

#include <vector>

#include "assembly/point_families.hpp"

namespace perikit {

template <int D>
struct LocalForcePoint {
  std::vector<double> own;      ///< [k][D]: stencil of the owner's gradient (whole family)
  std::vector<double> domain;   ///< [q][k][D]: of the gradient of bond q, the whole family's where it has none
  AlignedVector<double> share;  ///< w_ij of the energy, by bond
  std::vector<double> scale;    ///< weight of the local force state (volume of the domain over that of the family) over w_ij
  FamilyArrays family;

  const double* at(std::size_t q, std::size_t k) const noexcept {
    return domain.data() + (q * static_cast<std::size_t>(family.bonds) + k) * D;
  }
  /// For one block row of families. family_volume: sum of V over the whole family.
  void build(const WeightedKinematics& kinematics, const PointFamilies& families, std::size_t row, double family_volume);

 private:
  AlignedVector<double> omega_;
};

}  // namespace perikit
