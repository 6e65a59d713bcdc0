#pragma once
#include <cstdint>
#include <vector>

#include "perikit/core/field.hpp"
#include "perikit/model/kinematics.hpp"

namespace perikit {

/// Bonds of one family as arrays, padded; the memory behind a FamilyView.
struct FamilyArrays {
  void resize(int dimension, int bonds);
  FamilyView view(double horizon) const noexcept;
  int dimension = 3, bonds = 0;
  std::size_t size = 0;  ///< padded(bonds)
  AlignedVector<double> xi[3], length, volume;
  AlignedVector<double> omega;      ///< b omega
  AlignedVector<double> integrity, whole;  ///< b, and omega without it, where some bond of the family is not whole; else empty
  std::vector<std::int32_t> far;    ///< internal indices
  std::int32_t owner = -1;          ///< likewise; -1: of a class of points
  double inverse_shape[6] = {};     ///< K^-1; 0 where the point has no gradient
  bool fragment = false;            ///< failed bonds have left too little for any gradient, of the point or of parts of its family

  double whole_omega(std::size_t k) const noexcept { return whole.empty() ? omega[k] : whole[k]; }
  double b(std::size_t k) const noexcept { return integrity.empty() ? 1.0 : integrity[k]; }
};

/// K^-1 of the bonds of a family whose Families have no shape tensors; 0 where they span no volume.
void find_inverse_shape(FamilyArrays& family);

/// Point gradient of order n: Hbar = sum_k u_k (x) g_k over the bonds, u_k relative to the owner; g[k * d + e]. Order 1:
/// g_k = b omega V_k K^-1 xi_k, 0 where K is singular. The order that the family supports is returned, 0 for no gradient at all.
int point_gradient(const FamilyArrays& family, double horizon, int order, std::vector<double>& g);

}  // namespace perikit
