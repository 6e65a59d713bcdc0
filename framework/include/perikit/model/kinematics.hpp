#pragma once
/// Kinematics. Correspondence formulations are linear operators from displacements to displacement gradients H = F - I at evaluation
/// points. A kinematics states its *stencil*; the engine applies it and its exact adjoint, so that force = -dE/du, the tangent and the
/// momentum balances hold for every formulation without further code. A library implements one of four small classes:
///
// clang-format off
///   PointKinematics     one evaluation point per point, H_i = Hbar_i, the point gradient of order n, or a few in its cell (conventional)
///   BondKinematics      one per bond: H_b = A_b + (u_b - A_b xi) (x) g_b, A_b = (1 - s) Hbar_i + s Hbar_j, s = 0, 1/2
///                       (projection, baqp) or any other share
///   WeightedKinematics  one or more per point: H_q = (sum_k omega_q(k) V_k u_k (x) xi_k) K_q^-1 (non_spherical, sub_horizon, ...)
///   PairKinematics      no gradients and no material evaluations: central forces along the bonds (bond_based, ordinary)
// clang-format on
///
/// or puts a map of the gradients over one with evaluation points at bonds or parts of families: MappedKinematics (selective).
///
/// Hbar is the point gradient, a service of the engine: (sum_j omega V_j u_ij (x) xi_ij) K_i^-1 for order 1.
/// All gradients are exact for affine motion whatever the library returns.
///
/// A pair law is stated by its energy, with e = |xi + u_j - u_i| - |xi| the extension of a bond:
///   E = sum over pairs V_i V_j w(e; |xi|, omega, c_ij) + sum_i V_i phi(theta_i; k_i),   theta_i = (d/m_i) sum_j omega |xi| e V_j,
///   m_i = sum_j omega |xi|^2 V_j over intact bonds,   c_ij = f_ij (c_i + c_j)/2, f_ij: see BondFactorsOf.
/// The engine makes extensions, dilatations, forces and tangents of it; both moduli come from the small strain of the material.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "perikit/core/simd.hpp"
#include "perikit/model/family_point.hpp"

namespace perikit {

/// One family (or a part of one) as arrays over its bonds, padded to `padding` with bonds of zero weight and unit xi.
struct FamilyView {
  int dimension = 3;
  int bonds = 0;                   ///< entries; padded(bonds) can be read and written
  double horizon = 0;              ///< delta [m]
  const double* xi[3] = {};        ///< bond vectors [m]; unused axes null
  const double* length = nullptr;  ///< |xi| [m]
  const double* volume = nullptr;  ///< V_j [m^3]; 0 in the padding
  const double* omega = nullptr;   ///< influence (with bond integrity); 0 in the padding
  /// Inverse of the owner's shape tensor, symmetric: xx | xx yy xy | xx yy zz xy xz yz. Read it by `shape`.
  const double* inverse_shape = nullptr;
  std::size_t inverse_shape_stride = 0;  ///< 0: one owner of all bonds; else each bond has its own

  /// Component c of it for bond k, and where it is stored.
  double shape(int c, int k) const noexcept { return *shape_of(c, k); }
  const double* shape_of(int c, int k) const noexcept {
    return inverse_shape_stride == 0 ? inverse_shape + c : inverse_shape + static_cast<std::size_t>(c) * inverse_shape_stride + k;
  }
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
  const double* inverse_length = nullptr;  ///< reciprocal(|xi|) [1/m] where it is at hand, as on lattices; else null

  /// The same of the bonds from k on, at hand or not.
  Pack inverse_lengths(int k) const noexcept { return inverse_length ? Pack::load(inverse_length + k) : reciprocal(Pack::load(length + k)); }
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

enum class BondBase {
  own,
  mean,
  blend
};  ///< A_b: the gradient of the owner, the mean of both ends, or (1 - far_share) of the owner's and far_share of the other
enum class BondWeight { volume, kernel };      ///< W_ij = V_i w_ij, w_ij = V_j / sum V_j or omega V_j / sum omega V_j
enum class ForceState { variational, local };  ///< forces: -dE/du, or each bond's own force state alone
enum class PartWeight {
  equal,
  volume
};  ///< W_q of the admissible parts of a point: equal shares of V_i, or shares as their volumes
enum class GradientMap { identity, selective };  ///< selective: the volume change of every evaluation point is that of its owner

struct BondTraits {
  int order = 1;                            ///< of the point gradient
  BondBase base = BondBase::own;
  double far_share = 0.5;  ///< of `blend`, in [0, 1]
  BondWeight weight = BondWeight::volume;
  bool pair_symmetric = false;              ///< g depends on xi alone: ij and ji give the same H and are evaluated once (base = mean)
  bool g_from_xi_only = false;              ///< g is odd in xi and independent of omega and the shape tensor
};

struct WeightedTraits {
  BondWeight weight = BondWeight::volume;       ///< of evaluation points that belong to bonds
  PartWeight part_weight = PartWeight::equal;   ///< of evaluation points that belong to parts of the family
  /// local (one evaluation point per bond only, for comparison): T_ij = (V of the domain / V of the family) omega P_ij K_ij^-1 xi_ij. Not
  /// conservative: forces are not -dE/du, moments do not balance, the tangent is not symmetric.
  ForceState force_state = ForceState::variational;
};

/// Factors f_ij on the bonds of a pair law (w must be proportional to c_ij).
///   energy    bonds near surfaces: a homogeneous stretch along each axis stores as much in them as in a whole family
///   moments   all bonds: fourth moments of each family are those of an integral over it, and third ones vanish inside of clouds, so that uniform strains have the
///             energy of the material and are in equilibrium; theta counts with omega f
enum class BondFactorsOf { none, energy, moments };

struct PairTraits {
  bool influence = true;                    ///< w or theta depends on omega
  bool constant_moduli = false;             ///< c_i depends on the material alone, not on the family
  BondFactorsOf factors = BondFactorsOf::none;
};

/// What a library hands out: an object of exactly one of the classes below.
class Kinematics {
 public:
  virtual ~Kinematics() = default;
};

class PointKinematics : public Kinematics {
 public:
  /// Of the point gradient, from 1.
  virtual int order() const noexcept = 0;
  /// Whether the energy of a point counts with the second moments of its cell, over orders above 1: evaluation points at X_i +- s e_a instead of
  /// one at X_i, with the gradient there of the fit of order n. Nothing: on lattices, whose cells are known.
  virtual std::optional<bool> cell_moments() const noexcept { return false; }
};

class BondKinematics : public Kinematics {
 public:
  virtual BondTraits traits() const noexcept = 0;
  /// g_b for each bond of the view, g[c * stride + k], c < dimension [1/m]. Fully overwritten.
  virtual void correction(const FamilyView& family, double* g, std::size_t stride) const noexcept = 0;
};

class WeightedKinematics : public Kinematics {
 public:
  virtual WeightedTraits traits() const noexcept = 0;
  /// Evaluation points per point of a body of this dimension; 0: one per bond. Throws InputError where the options do not suit the
  /// dimension; asked at set-up.
  virtual int parts(int dimension) const = 0;
  /// Influence of bond k in evaluation point q (part q, or the bond q itself), for all of both: omega[q * stride + k], at most the
  /// view's omega[k] for a part. Rows can be written up to padded(bonds); their bonds must be. A part without a well-conditioned
  /// gradient of its own is dropped and the others share its weight; a bond's domain without one, and a family without any part, use
  /// the whole family.
  virtual void weights(const FamilyView& family, double* omega, std::size_t stride) const noexcept = 0;
};

/// phi and its derivatives.
class DilatationLaw {
 public:
  virtual ~DilatationLaw() = default;
  virtual void evaluate(const DilatationBatch& batch) const noexcept = 0;
};

class PairKinematics : public Kinematics {
 public:
  virtual PairTraits traits() const noexcept = 0;
  /// Moduli of one point, asked for at set-up.
  virtual PairModuli moduli(const PairPoint& point) const noexcept = 0;
  /// What is wrong with the law for such a point, as one line for the log; empty: nothing.
  virtual std::string warning(const PairPoint& point) const = 0;
  /// w and its derivatives.
  virtual void bond_law(const BondBatch& batch) const noexcept = 0;
  /// Null: phi is zero. Else it lives as long as the kinematics.
  virtual const DilatationLaw* dilatation() const noexcept = 0;
};

/// A map of the gradients over a base with evaluation points at bonds or parts of families.
///   selective: F_q <- (Jbar_i / J_q)^(1/3) F_q, Jbar_i from the point gradient of the owner i. Not in plane or uniaxial stress.
class MappedKinematics : public Kinematics {
 public:
  virtual GradientMap map() const noexcept = 0;
  /// A BondKinematics or a WeightedKinematics, the same at each call, that lives as long as the map.
  virtual const Kinematics& base() const noexcept = 0;
};

}  // namespace perikit
