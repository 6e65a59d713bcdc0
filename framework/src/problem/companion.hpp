#pragma once
/// A cheap relative of a body's tangent, for preconditioners.

#include <vector>

#include "perikit/body/body.hpp"
#include "perikit/core/block_matrix.hpp"
#include "families/families.hpp"
#include "perikit/operators/laws.hpp"

namespace perikit {

/// The same points and moduli on the smallest family: springs between points up to the diagonal of a face apart (18 neighbours on
/// a lattice in 3D, 8 in 2D, 2 in 1D) that resist stretch and, less, sliding,
///   k_ij = V_i V_j omega (a_i/m_i + a_j/m_j) n (x) n + the same with b (I - n (x) n),   n = y_ij/|y_ij|,
///   omega = 1 in 3D, |xi|^-2 else: isotropic on lattices,
///   m_i = sum_j omega |xi|^2 V_j,   a - b = d (d + 2) lambda,  b = 2 d (mu - lambda),
/// so that affine motions store the energy of the isotropic law where lambda <= mu (Born's model); where lambda > mu springs
/// cannot, and a = d (d + 2) sqrt(mu (lambda + 2 mu)/3) lies between shear and volume. b is at least 0.05 a, so that the matrix
/// is positive definite wherever every connected part is held. Bonds that a pre-crack cuts are left out; springs weaken as the
/// bonds between their ends do, to a thousandth: what longer bonds still hold together stays so.
class Companion {
 public:
  /// Both must outlive it.
  Companion(const Families& families, const Laws& laws);
  /// Bulk moduli count as at most so many shear moduli from now on.
  void limit_bulk(double most);
  /// K at u, a pattern of nearest neighbours, with the bonds as they are. Deterministic for any number of threads.
  void assemble(ConstFieldView u, BlockMatrix& K) const;

 private:
  void find_pattern();
  /// Share of the stiffness that is left, of each spring in the order of lists_; empty where all are whole.
  std::vector<double> shares() const;
  double influence(double xi2) const noexcept { return dimension_ == 3 ? 1 : 1 / xi2; }

  const Families& families_;
  const Laws& laws_;
  const Body& body_;
  double most_bulk_ = 0;                 ///< that stretch_ and slide_ know
  int dimension_;
  std::vector<std::int32_t> point_;      ///< field indices of live points, ascending
  std::vector<double> rows_;             ///< of them {x, y, z, V}
  FamilyLists lists_;                    ///< of rows
  std::vector<double> stretch_, slide_;  ///< a_i/m_i, b_i/m_i of each row
};

}  // namespace perikit
