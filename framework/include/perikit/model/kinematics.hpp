#pragma once
/// Kinematics: linear operators from displacements to displacement gradients H = F - I at evaluation points. A kinematics states
/// its *stencil*; the engine applies it and its exact adjoint, so that force = -dE/du, the tangent and the momentum balances hold
/// for every formulation without further code.
///
/// Three shapes cover the family of correspondence formulations:
///
///   point     one evaluation point per point:   H_i = Hbar_i, the point gradient of order n          (conventional)
///   bond      one per bond, H_b = A_b + (u_b - A_b xi) (x) g_b, A_b = Hbar_i or (Hbar_i + Hbar_j)/2  (baqp, projection, ...)
///   weighted  one or more per point, H_q = (sum_k omega_q(k) V_k u_k (x) xi_k) K_q^-1               (non_spherical, sub_horizon, ...)
///
/// Hbar is the point gradient, a service of the engine: (sum_j omega V_j u_ij (x) xi_ij) K_i^-1 for order 1.
/// Every shape is exact for affine motion whatever the plugin returns.

#include <cstddef>
#include <vector>

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

enum class EvaluationPoints { points, bonds, weighted };
enum class BondBase { own, mean };          ///< A_b of the bond shape
enum class BondWeight { volume, kernel };   ///< W_ij = V_i w_ij, w_ij = V_j / sum V_j or omega V_j / sum omega V_j
enum class PartWeight { equal, volume };    ///< W_q of the admissible parts of point i: the same share of V_i, or shares as their volumes

struct KinematicsTraits {
  EvaluationPoints at = EvaluationPoints::points;
  int order = 1;                            ///< of the point gradient Hbar
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
  /// weighted shape: influence of bond k in evaluation point q (part q, or the bond q itself): omega[k] for all bonds, at most the
  /// view's omega for a part. Fully overwritten. A part without a well-conditioned gradient of its own is dropped and the others share
  /// its weight; a bond's domain without one, and a family without any part, use the whole family.
  virtual void weights(const FamilyView&, int /*q*/, double* /*omega*/) const noexcept {}
};

}  // namespace perikit
