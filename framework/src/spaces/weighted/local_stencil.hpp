#pragma once
/// The stencil of one family for the weighted shape, in factors:
///
///   H_q = sum_k u_k (x) g_qk,   g_qk = omega_q(k) K_q^-1 b_k,   b_k = V_k xi_k,   K_q = sum_k omega_q(k) b_k (x) xi_k.
///
/// One number is kept for a pair (q, k), not one vector, and the sums over k for all q are one matrix product: the influence
/// times the columns (b_k (x) xi_k, u_k (x) b_k). The adjoint is the transposed product with the columns P_q K_q^-1.
///
/// Point gradients of higher order are b_k, with influence and K of 1; the evaluation points in the cell of a point, where its second moments count,
/// have the gradient of the fit at X_i +- s e_a, s^2 = D h^2/12, with equal shares: sum_q w_q x_q (x) x_q is that of a cube of width h.
///
/// Local force states (evaluation points at bonds) test the stress of a bond with that bond alone instead: with w_q the share of the energy,
///   t_q = (sum of V over the domain of q / sum of V over the family) / w_q  P_q g_qq                    [Partmann et al. 4.20]

#include <cstdint>
#include <vector>

#include "families/family_arrays.hpp"
#include "model/formulation.hpp"
#include "perikit/core/field.hpp"
#include "spaces/weighted/stencil_shift.hpp"

namespace perikit {

/// What the stencil of any family needs to know.
struct StencilRules {
  const Formulation* formulation;
  double horizon;
  /// Of balanced clouds, by point (spaces/shift.hpp): of the owners' gradients, where the map is selective, then of those of parts.
  ConstFieldView shift = {};
  bool at_points() const noexcept { return formulation->point != nullptr; }  ///< a point gradient of higher order
  bool local() const noexcept { return formulation->force_state == ForceState::local; }
};

/// Evaluation points of one point. With the selective map, the owner's own gradient comes first, with no share.
template <int D>
class LocalStencil {
 public:
  /// For families that carry up to two `fields` of displacements: u[f][c]: component c of field f relative to the owner, by bond,
  /// `family.size` long. bond_share: w_ij of each bond, used where evaluation points belong to bonds. family_volume: sum of V over the
  /// uncut family, for local force states.
  void build(const StencilRules& rules, const FamilyArrays& family, const double* bond_share, int fields, const double* const (*u)[D],
             double family_volume = 0);

  int bonds() const noexcept { return bonds_; }
  int points() const noexcept { return points_; }
  double share(int q) const noexcept { return share_[static_cast<std::size_t>(q)]; }  ///< w_q; their sum is 1
  int fallbacks() const noexcept { return fallbacks_; }  ///< evaluation points that use the whole family
  int dropped() const noexcept { return dropped_; }      ///< parts without a gradient of their own

  /// H of evaluation points first ... first + n - 1 of a field, H[component * stride + lane]; first is a multiple of 8, and so
  /// many lanes are written.
  void gradient(int field, int first, int n, double* H, std::size_t stride) const noexcept;
  /// Adds to the stress of these points: columns P_q K_q^-1, zero at first.
  void add_stress(int first, int n, const double* P, std::size_t stride) noexcept;
  /// t_k = sum_q P_q g_qk by bond, t[c][k], from all stresses; of local force states t_k = tested_k P_k g_kk.
  void adjoint(double* const (&t)[D]) noexcept;
  /// g_qk, all of them: g[(q * bonds + k) * D + e].
  void expand(std::vector<double>& g) const;
  /// g_qk without the shift of one evaluation point: g[k * D + e].
  void expand_one(int q, double* g) const;
  /// The influence of bond k in evaluation point q, and an entry of K_q^-1, 0 where it has no gradient.
  double influence(int q, int k) const noexcept { return influences(q)[k]; }
  const double* influences(int q) const noexcept { return omega_.data() + static_cast<std::size_t>(q) * row_; }
  double inverse(int q, int entry) const noexcept { return inverse_[static_cast<std::size_t>(entry) * lanes_ + static_cast<std::size_t>(q)]; }
  /// Local force states: the factor of P_q g_qq; empty for others.
  const std::vector<double>& tested() const noexcept { return tested_; }

 private:
  /// All but the shift.
  void make(const StencilRules& rules, const FamilyArrays& family, const double* bond_share, int fields, const double* const (*u)[D],
            double family_volume);
  void set_shift(const StencilRules& rules, const FamilyArrays& family);
  void set_lever(const StencilRules& rules, const FamilyArrays& family);
  /// Evaluation points around a point in its cell, by what their gradients differ from that of the point.
  void set_cell(const StencilRules& rules, const FamilyArrays& family);
  template <int Fields>
  void fill_columns(const FamilyArrays& family, const double* const (*u)[D]);
  /// The kinematics' influence of every bond in every evaluation point.
  void weigh(const StencilRules& rules, const FamilyArrays& family, double* rows);
  /// Sums of the tiles that hold rows [begin, end): moments_ = omega_ columns_.
  void multiply(int begin, int end) noexcept;
  /// K_q^-1 of row q, or of all rows, and whether they are regular: the eigenvalues of K spread by less than 1 / ratio.
  void invert_one(int q, double ratio);
  void invert_all(double ratio);
  void set_tested(const FamilyArrays& family, double family_volume, int first);
  /// What the eigenvalues of the K of a part or domain must not spread beyond: `beside` times those of the family, or poor_ratio.
  double least_ratio(const FamilyArrays& family, double beside) const;

  int bonds_ = 0, points_ = 0, fallbacks_ = 0, dropped_ = 0;
  int order_ = 1;                  ///< of the point gradient that the family has
  std::size_t row_ = 0;            ///< padded(bonds)
  std::size_t lanes_ = 0;          ///< padded(points)
  std::size_t width_ = 0;          ///< columns, padded to packs
  AlignedVector<double> omega_;    ///< [q * row_ + k]
  AlignedVector<double> lever_;    ///< b: [c * row_ + k]
  AlignedVector<double> columns_;  ///< [k * width_ + column]: K, then the fields
  AlignedVector<double> moments_;  ///< [q * width_ + column]
  AlignedVector<double> inverse_;  ///< K_q^-1: [entry * lanes_ + q]; 0 where q is dropped
  AlignedVector<double> stress_;   ///< P_q K_q^-1: [component * lanes_ + q]
  AlignedVector<double> share_;
  std::vector<std::uint8_t> regular_;
  std::vector<double> tested_;
  StencilShift<D> shift_;
};

}  // namespace perikit
