#pragma once
/// The gradient stencil of one family for the weighted shape (with the selective map, the owner's own gradient comes first, with no share): H_q = sum_k u_k (x) g_qk, g_qk = omega_q(k) V_k K_q^-1 xi_k, for all
/// evaluation points q of one point.

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
  std::size_t size = 0;                      ///< padded(bonds)
  AlignedVector<double> xi[3], length, volume, omega;
  double inverse_shape[6] = {};
};

/// g[e][tile][k][8]: component e of g for evaluation points 8 tile ... 8 tile + 7 and bond k. Padding is zero.
struct LocalStencil {
  int bonds = 0, points = 0, tiles = 0;
  AlignedVector<double> g;
  AlignedVector<double> share;               ///< w_q, padded; their sum is 1
  int fallbacks = 0;                         ///< evaluation points that use the whole family
  int dropped = 0;                           ///< parts without a gradient of their own
  const double* row(int e, int tile) const noexcept {
    return g.data() + (static_cast<std::size_t>(e) * tiles + tile) * static_cast<std::size_t>(bonds) * 8;
  }
  std::size_t bytes() const noexcept { return (g.size() + share.size()) * sizeof(double); }
};

/// bond_share: w_ij of each bond (used where evaluation points belong to bonds). scratch: padded(bonds) doubles.
void build_stencil(const Kinematics& kinematics, const KinematicsTraits& traits, const FamilyArrays& family, double horizon,
                   const double* bond_share, LocalStencil& out, AlignedVector<double>& scratch);

}  // namespace perikit
