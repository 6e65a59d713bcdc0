#pragma once
/// Kinematics. Correspondence formulations are linear operators from displacements to displacement gradients H = F - I at evaluation points. A kinematics states
/// its *stencil*; the engine applies it and its exact adjoint, so that force = -dE/du, the tangent and the momentum balances hold
/// for every formulation without further code.
///
/// Three shapes cover the family of correspondence formulations:
///
///   point     one evaluation point per point:   H_i = Hbar_i, the point gradient of order n          (conventional)
///   bond      one per bond, H_b = A_b + (u_b - A_b xi) (x) g_b, A_b = Hbar_i or (Hbar_i + Hbar_j)/2  (baqp, projection, ...)
///   weighted  one or more per point, H_q = (sum_k omega_q(k) V_k u_k (x) xi_k) K_q^-1               (non_spherical, sub_horizon, ...)
///   pairs     no gradients and no material evaluations: central forces along the bonds                 (bond_based, ordinary)
///
/// Hbar is the point gradient, a service of the engine: (sum_j omega V_j u_ij (x) xi_ij) K_i^-1 for order 1.
/// Every shape with gradients is exact for affine motion whatever the plugin returns.
///
/// A pair law is stated by its energy, with e = |xi + u_j - u_i| - |xi| the extension of a bond:
///   E = sum over pairs V_i V_j w(e; |xi|, omega, c_ij) + sum_i V_i phi(theta_i; k_i),   theta_i = (d/m_i) sum_j omega |xi| e V_j,
///   m_i = sum_j omega |xi|^2 V_j over intact bonds,   c_ij = (c_i + c_j)/2.
/// The engine makes extensions, dilatations, forces and tangents of it; both moduli come from the small strain of the material.

#include <cstddef>
#include <string>
#include <vector>

#include "perikit/model/family_point.hpp"

namespace perikit {

/// One family (or a part of one) as arrays over its bonds, padded to `padding` with bonds of zero weight and unit xi.
struct FamilyView {
  int dimension = 3;
  int bonds = 0;                      ///< entries; padded(bonds) can be read and written
  double horizon = 0;                 ///< delta [m]
  const double* xi[3] = {};           ///< bond vectors [m]; unused axes null
  const double* length = nullptr;     ///< |xi| [m]
  const double* volume = nullptr;     ///< V_j [m^3]; 0 in the padding
  const double* omega = nullptr;      ///< influence (with bond integrity); 0 in the padding
  /// Inverse of the owner's shape tensor, symmetric: xx | xx yy xy | xx yy zz xy xz yz. Component c of bond k at
  /// inverse_shape[c * inverse_shape_stride + k * (inverse_shape_stride != 0)]: one owner, or one per bond.
  const double* inverse_shape = nullptr;
  std::size_t inverse_shape_stride = 0;
};

/// What the moduli of a pair law at one point may depend on.
struct PairPoint : FamilyPoint {
  double weighted_volume = 0;         ///< m_i over intact bonds [m^5 times the unit of omega]; 0 without any
  double intact = 1;                  ///< share of the family's influence that is not broken
};

struct PairModuli {
  double bond = 0;                    ///< c_i
  double dilatation = 0;              ///< k_i
};

/// Arrays over n bonds that can be read (bonds at rest) and written up to padded(n). A null output is not wanted; the others are
/// overwritten for all n bonds.
struct BondBatch {
  int n = 0;
  const double* length = nullptr;     ///< |xi| [m]
  const double* omega = nullptr;      ///< influence
  const double* extension = nullptr;  ///< e [m]
  const double* modulus = nullptr;    ///< c_ij
  double* energy = nullptr;           ///< w [J/m^6]
  double* force = nullptr;            ///< dw/de [N/m^6]; exactly 0 at e = 0
  double* stiffness = nullptr;        ///< d2w/de2 [N/m^7]
};

/// Arrays over n points, as above.
struct DilatationBatch {
  int n = 0;
  const double* theta = nullptr;      ///< [-]
  const double* modulus = nullptr;    ///< k_i
  double* energy = nullptr;           ///< phi [J/m^3]
  double* pressure = nullptr;         ///< dphi/dtheta [Pa]; exactly 0 at theta = 0
  double* stiffness = nullptr;        ///< d2phi/dtheta2 [Pa]
};

enum class EvaluationPoints { points, bonds, weighted, pairs };
enum class BondBase { own, mean };          ///< A_b of the bond shape
enum class BondWeight { volume, kernel };   ///< W_ij = V_i w_ij, w_ij = V_j / sum V_j or omega V_j / sum omega V_j
enum class ForceState { variational, local };   ///< forces: -dE/du, or each bond's own force state alone
enum class PartWeight { equal, volume };    ///< W_q of the admissible parts of point i: the same share of V_i, or shares as their volumes

struct KinematicsTraits {
  EvaluationPoints at = EvaluationPoints::points;
  int order = 1;                            ///< of the point gradient (point and bond shapes)
  BondBase base = BondBase::own;            ///< bond shape
  BondWeight weight = BondWeight::volume;   ///< evaluation points that belong to bonds
  PartWeight part_weight = PartWeight::equal;   ///< evaluation points that belong to parts of the family
  /// bond shape: g depends on xi alone, so that ij and ji give the same H and are evaluated once (base = mean)
  bool pair_symmetric = false;
  /// bond shape: g is odd in xi and independent of omega and the shape tensor
  bool g_from_xi_only = false;
  /// The volume change of every evaluation point is that of its owner: F_q <- (Jbar_i / J_q)^(1/3) F_q. Not in plane or uniaxial
  /// stress, and not with evaluation points at points.
  bool selective = false;
  /// local (weighted shape by bond only, for comparison): T_ij = (sum of V over the domain / sum of V over H_i) omega P_ij K_ij^-1 xi_ij.
  /// Not conservative: forces are not -dE/du, moments do not balance, the tangent is not symmetric.
  ForceState force_state = ForceState::variational;
  bool dilatation = false;                  ///< pairs: phi is not zero
  bool influence = true;                    ///< pairs: w or theta depends on omega
  bool constant_moduli = false;             ///< pairs: c_i depends on the material alone, not on the family
  /// pairs: moduli of bonds near surfaces are scaled so that a homogeneous stretch along each axis stores as much in them as
  /// in a whole family (w must be proportional to c_ij)
  bool surface_correction = false;
};

class Kinematics {
 public:
  virtual ~Kinematics() = default;
  virtual KinematicsTraits traits() const noexcept = 0;
  /// weighted shape: evaluation points per point of a body of this dimension; 0: one per bond.
  /// Throws InputError where the options do not suit the dimension; asked at set-up.
  virtual int parts(int /*dimension*/) const { return 0; }
  /// bond shape: g_b for each bond of the view, g[c * stride + k], c < dimension [1/m]. Fully overwritten.
  virtual void correction(const FamilyView&, double* /*g*/, std::size_t /*stride*/) const noexcept {}
  /// weighted shape: influence of bond k in evaluation point q (part q, or the bond q itself), for all of both: omega[q * stride + k],
  /// at most the view's omega[k] for a part. Rows can be written up to padded(bonds); their bonds must be. A part without a
  /// well-conditioned gradient of its own is dropped and the others share its weight; a bond's domain without one, and a family
  /// without any part, use the whole family.
  virtual void weights(const FamilyView&, double* /*omega*/, std::size_t /*stride*/) const noexcept {}
  /// pairs: moduli of one point, asked for at set-up.
  virtual PairModuli pair_moduli(const PairPoint&) const noexcept { return {}; }
  /// pairs: what is wrong with the law for such a point, as one line for the log; empty: nothing.
  virtual std::string pair_warning(const PairPoint&) const { return {}; }
  /// pairs: w and its derivatives.
  virtual void bond_law(const BondBatch&) const noexcept {}
  /// pairs: phi and its derivatives.
  virtual void dilatation_law(const DilatationBatch&) const noexcept {}
};

}  // namespace perikit
