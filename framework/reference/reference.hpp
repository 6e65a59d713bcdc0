#pragma once
/// Slow, dense implementation of every formulation straight from its formulas, for comparison with the engine. It shares no code
/// with the engine: families by brute force, moments by eigendecomposition, every stencil stored point by point.
///
/// Displacements and forces are vectors of length d * n, component c of point i at d * i + c. Tensors that reach a material are
/// 3 x 3, zero outside the space of the body (plane strain, uniaxial strain).

#include "core/eigen.hpp"
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace perikit::reference {

using Vector = Eigen::VectorXd;
using Matrix = Eigen::MatrixXd;
using Tensor = Eigen::Matrix3d;

struct Cloud {
  int dimension = 3;
  std::vector<Vector> position;                    ///< [m], each of length d
  std::vector<double> volume;                      ///< [m^3]
  double horizon = 0;                              ///< delta [m]
  std::function<double(double)> influence;         ///< omega(r), r = |xi| / delta
  std::function<double(int, int)> integrity = {};  ///< b_ij in [0, 1], symmetric; empty: intact
  std::function<double(int, int)> factor = {};     ///< f_ij of pair laws, symmetric; empty: 1. In the linear solid it is that of omega in all sums but the surviving fraction
  bool failed = false;                             ///< bonds that are not intact were so at the set-up, and failed

  int points() const { return static_cast<int>(position.size()); }
  /// X_j - X_i [m].
  Vector bond(int i, int j) const { return position[j] - position[i]; }
  double omega(int i, int j) const { return influence(bond(i, j).norm() / horizon); }
  double factored(int i, int j) const { return factor ? factor(i, j) : 1.0; }
  double intact(int i, int j) const { return integrity ? integrity(i, j) : 1.0; }
  /// All j != i in the closed ball delta (1 + 1e-10), ascending, broken bonds included.
  std::vector<int> family(int i) const;
};

enum class Weight { volume, kernel };

/// A kinematics by name, with the options of its plugin.
struct Description {
  std::string name = "conventional";
  int order = 1;                                      ///< conventional, baqp, projection: of the point gradient
  double cell = 0;                                    ///< conventional: width of the cells whose second moments count; 0: none
  int parts = 0;                                      ///< sub_horizon: 0: 2^d; 1: the whole horizon; 4 in 1D: C's four-part split
  bool part_volumes = false;                          ///< sub_horizon: weights V_i V_alpha / V_H (over intact bonds) instead of V_i / parts
  double bond_horizon_ratio = 1;                      ///< bond_associated: radius of the ball around X_j over delta
  double lambda = 10;                                 ///< bond_augmented
  double n1 = 1, n2 = 1;                              ///< non_spherical
  std::optional<Weight> weight = {};                  ///< bond-level; unset: kernel for baqp, volume for the others
  std::shared_ptr<const Description> base = nullptr;  ///< selective
  bool local_force = false;                           ///< bond-level: the bond's own force state T_ij, not -dE/du
  /// A moment (of xi / delta) whose smallest eigenvalue is below this fraction of its largest is singular.
  double singular = 1e-10;
  /// The same for parts of families and domains of bonds.
  double poor = 1e-3;
  /// A part's must moreover not be below this share of the family's own fraction: a needle in a family that is none.
  double part = 0.05;
  double domain = 0.02;   ///< likewise of a domain's
};

/// g_k of the points k that move the gradient, ascending in k: H = sum_k u_k (x) g_k. Empty: dead, H = 0.
using Stencil = std::vector<std::pair<int, Vector>>;

struct EvaluationPoint {
  int owner = 0;
  int far = -1;       ///< far end of the bond it belongs to, or -1
  double weight = 0;  ///< W_q [m^3]
  Stencil stencil;
  double volume_share = 0;   ///< volume of the bond's domain over that of the owner's family
};

struct Operator {
  int dimension = 3;
  int points = 0;
  std::vector<EvaluationPoint> q;
  /// selective: stencil of Hbar at each point (empty where it is dead or was not needed); other kinematics: no entries.
  std::vector<Stencil> owner_gradient;
  std::vector<double> owner_share;    ///< selective: c of each point, the share left of its family at the set-up; otherwise no entries
  std::vector<double> owner_volume;   ///< local_force: V_i; otherwise no entries
};

/// Evaluation points of the given owners, in their order; no owners: of all points.
/// Throws std::invalid_argument for an unknown name.
Operator build(const Cloud&, const Description&, const std::vector<int>& owners = {});

/// Point gradient of order n at i, or of the highest lower order that the family supports; empty when none.
Stencil point_gradient(const Cloud&, int i, int order, double singular);

/// A hyperelastic law: H = F - I -> psi, P = dpsi/dF, A = dP/dF (9 x 9, components row-major: xx xy xz yx ...).
struct Law {
  std::function<double(const Tensor&)> psi;
  std::function<Tensor(const Tensor&)> P;
  std::function<Matrix(const Tensor&)> A;
};

/// H of a stencil, 3 x 3, zero-padded.
Tensor gradient(const Stencil&, int dimension, const Vector& u);

double energy(const Operator&, const Law&, const Vector& u);
/// -dE/du, or the forces of local force states.
Vector force(const Operator&, const Law&, const Vector& u);
/// d2E/du2.
Matrix stiffness(const Operator&, const Law&, const Vector& u);

/// `selective` at one evaluation point: Fhat = (1 - c + c (Jbar / Jt)^(1/3)) Ft, its psi, and psi's derivatives by (Ft, Fbar).
struct Selective {
  Tensor H;  ///< Fhat - I
  double psi = 0;
  Tensor S_own, S_bar;  ///< dpsi/dFt, dpsi/dFbar
  Matrix tangent;       ///< 18 x 18, rows and columns (Ft, Fbar)
};
Selective selective(const Law&, const Tensor& H_own, const Tensor& H_bar, double share = 1);

/// Lame constants as the d-dimensional body sees them (plane stress: condensed; 1D: lambda + 2 mu is the modulus), and the
/// thickness (2D, m) or area (1D, m^2) that is contained in the volumes.
struct Elasticity {
  double lambda = 0, mu = 0, section = 1;
  double bulk(int d) const { return lambda + 2 * mu / d; }
};

/// Pair laws "bond_based" and "ordinary".
double pair_energy(const Cloud&, const std::string& name, const Elasticity&, const Vector& u);
Vector pair_force(const Cloud&, const std::string& name, const Elasticity&, const Vector& u);

/// What the polynomial of degree 1 ... order that fits u_j - u_i best, by weights b omega V, has at each bond of i: row k of the matrix times the
/// differences of the family. The highest order not above this one that the family supports; empty when none.
Matrix polynomial_fit(const Cloud&, int i, int order, double singular);

/// Zero-energy penalties "silling" (with its coefficient G) and "wan" of a point gradient of the given order. Quadratic in u:
/// this is d2E/du2, E = u.Su/2, force = -Su. whole: of what the whole fit leaves of a bond, else of what its linear part does.
Matrix stabilization(const Cloud&, const std::string& name, const Elasticity&, double coefficient = 1, int order = 1,
                     double singular = 1e-10, bool whole = true);

}  // namespace perikit::reference
