#pragma once
/// The zero-energy penalty of one point as part of its element. With w_k = V_i omega V_k for the bonds of i,
///
///   sum_j w_j z_ij . M z_ij = sum_k w_k u_ik . M u_ik - H_i S . M H_i,   S = sum_k w_k xi_k (x) xi_k
///
/// (H_i is the weighted least-squares fit of the family): springs from the point to its neighbours, less a tangent of the gradient
/// like that of a material, A_aebf = M_ab S_ef.

#include "engine/assembly/point_families.hpp"
#include "engine/shape_tensor.hpp"
#include "perikit/engine/model.hpp"

namespace perikit {

template <int D>
class PenaltyElement {
 public:
  /// Of a block row. Where its shape tensor is singular there is no penalty and false is returned.
  bool load(const ModelParts& parts, const PointFamilies& families, std::size_t row);
  /// A (D^2 x D^2 over in-space components) -= M (x) S.
  void subtract_seen(double* A) const noexcept;
  /// K[a][b][k][l] += springs; nodes k, l: the family and, at place `own`, the point itself; rows of `width`.
  void add_springs(std::size_t own, std::size_t width, double* K) const noexcept;

 private:
  FamilyArrays family_;
  AlignedVector<double> spring_;   ///< w_k
  Square<D> M_, S_;
};

}  // namespace perikit
