#pragma once
/// The zero-energy penalty of one point as part of its element. With w_k = V_i omega V_k for the bonds of i and the point gradient
/// H_i = sum_k u_ik (x) g_k,
///
///   sum_k w_k z_ik . M z_ik = sum_k w_k u_ik . M u_ik - 2 (sum_k w_k u_ik (x) xi_k) : M H_i + H_i S : M H_i,   S = sum_k w_k xi_k (x) xi_k:
///
/// springs from the point to its neighbours and what the gradient sees. At order 1 H_i is the weighted least-squares fit of the
/// family, sum_k w_k u_ik (x) xi_k = H_i S, and the rest is a tangent of the gradient like that of a material, -M_ab S_ef.

#include "assembly/point_families.hpp"
#include "families/shape_tensor.hpp"
#include "perikit/terms/model.hpp"

namespace perikit {

template <int D>
class PenaltyElement {
 public:
  /// Of a block row. Where its shape tensor is singular there is no penalty and false is returned.
  bool load(const ModelParts& parts, const PointFamilies& families, std::size_t row);
  /// Order 1: A (D^2 x D^2 over in-space components) -= M (x) S. Higher orders: nothing, add_springs adds it all.
  void subtract_seen(double* A) const noexcept;
  /// K[a][b][k][l] += springs; nodes k, l: the family and, at place `own`, the point itself; rows of `width`.
  void add_springs(std::size_t own, std::size_t width, double* K);

  const FamilyArrays& family() const noexcept { return family_; }
  double spring(std::size_t k) const noexcept { return spring_[k]; }          ///< w_k
  double gradient(std::size_t k, int e) const noexcept { return gradient_[k * D + static_cast<std::size_t>(e)]; }   ///< g_k of orders > 1
  double matrix(int a, int b) const noexcept { return M_[a][b]; }

 private:
  void add_higher_order(std::size_t own, std::size_t width);

  FamilyArrays family_;
  AlignedVector<double> spring_;
  std::vector<double> gradient_;   ///< empty for order 1
  std::vector<double> seen_;       ///< N of orders > 1, [k][l] over nodes: what the gradient sees of sum_k w_k z_ik . M z_ik is M_ab N_kl
  std::vector<double> node_;       ///< by node: w xi, then g, the point's own entries closing the sums
  double M_[D][D], S_[D][D];
};

}  // namespace perikit
