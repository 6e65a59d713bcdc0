#pragma once
/// Penalties on what a point gradient does not see. With z_ij = u_ij - Hbar_i xi_ij, the part of a bond that the gradient of its owner
/// leaves over, a stabilization states one symmetric matrix M_i per point; the engine makes of it
///
///   E = 1/2 sum_i V_i sum_j V_j omega_ij z_ij . M_i z_ij           (z is linear in u: E is quadratic, its tangent constant)
///   T_ij = omega_ij M_i z_ij,   force density sum_j (T_ij - T_ji) V_j
///
/// Over gradients of order n > 1 the fit of order n, from which Hbar_i is taken, may be subtracted whole instead of Hbar_i xi_ij alone (PenaltyFit):
/// then E vanishes for all polynomials up to degree n, bending among them.
/// The simple force state is the exact derivative where the fit is whole, at order 1 always: it is the minimiser of sum_j omega |z|^2 V_j, hence
/// sum_j omega z q(xi) V_j = 0 for each of its monomials q. Of the linear part of a fit of higher order the engine adds the derivative through Hbar_i.
/// E vanishes for affine motions. Under a superposed rotation z turns: E is objective, and its forces keep angular momentum, where
/// M_i is a multiple of I.

#include "perikit/model/family_point.hpp"

namespace perikit {

/// What M_i may depend on.
struct PenaltyPoint : FamilyPoint {
  double mean_influence = 0;                ///< sum_j omega V_j / sum_j V_j of the family before any bond broke [unit of omega]
  /// K_i^-1 = (sum_j omega xi (x) xi V_j)^-1 over intact bonds: xx | xx yy xy | xx yy zz xy xz yz [1/(m^5 times the unit of omega)].
  const double* inverse_shape = nullptr;
};

/// What is subtracted from a bond, over gradients of order n: their linear part Hbar_i xi, or the whole fit. The same at order 1.
enum class PenaltyFit { linear, whole };

struct StabilizationTraits {
  bool isotropic = false;                   ///< M_i = m_i I: `penalty` writes one number
  PenaltyFit fit = PenaltyFit::whole;
};

class Stabilization {
 public:
  virtual ~Stabilization() = default;
  virtual StabilizationTraits traits() const noexcept = 0;
  /// M_i [N/m^7 over the unit of omega], symmetric with the components of inverse_shape, or m_i; positive semi-definite. Asked for at
  /// set-up, for points whose shape tensor has eigenvalues less than a factor of 1000 apart; others carry none. Fully overwritten.
  virtual void penalty(const PenaltyPoint& point, double* M) const noexcept = 0;
};

}  // namespace perikit
