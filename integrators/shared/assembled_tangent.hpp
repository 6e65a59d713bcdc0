#pragma once
/// The assembled tangent that linear solvers work with: exact near equilibrium, convex far from it.

#include <limits>
#include <string>

#include "perikit/sdk/equilibrium.hpp"
#include "sparse_solver.hpp"

namespace perikit {

/// True where a residual is not yet that of an equilibrium: above a tenth of its reference.
inline bool far_from(const Equilibrium& equilibrium) {
  return equilibrium.relative_residual() > 0.1;
}

/// Reciprocal condition of factors below which the sign of a pivot, and the answer along some motion, is rounding.
inline constexpr double nearly_singular = 1e-14;

/// The tangent at a state as a matrix, and its factors. Far from equilibrium an indefinite tangent tells of errors more than of
/// the body: a full step leaves errors of second order in volumes, which the bulk modulus turns into pressures. There it is
/// assembled without the negative curvatures of single evaluation points (BlockMatrix::convex), as in projected Newton methods
/// [Teran et al. 2005]; and once that has been needed at a load, at all states far from equilibrium at this load: definite
/// tangents between indefinite ones are nearly singular, and their steps too long.
class AssembledTangent {
 public:
  /// Assembles it, as a rule at the state of the last residual. False where that is inadmissible or memory is short; `failure` says why.
  /// may_convex: false where it shall be exact everywhere.
  bool assemble(Equilibrium& equilibrium, const Configuration& at, bool may_convex, std::string& failure);
  /// The same, and factorises it.
  bool make(Equilibrium& equilibrium, const Configuration& at, bool may_convex, std::string& failure);
  /// x <- K^-1 b on free components, 0 elsewhere, after make(). b and x may be the same field.
  void solve(ConstFieldView b, FieldView x) { solver_.solve(b, x); }
  /// Kw <- K w on free components, 0 elsewhere.
  void multiply(ConstFieldView free, ConstFieldView w, FieldView Kw) const;

  const BlockMatrix& matrix() const noexcept { return matrix_; }
  const SparseSolver& factors() const noexcept { return solver_; }
  /// Whether the exact tangent that was factorised last has negative eigenvalues, of more than rounding: its equilibrium is unstable.
  bool indefinite() const noexcept;
  /// What was left out of the matrix are negative curvatures.
  bool convex() const noexcept { return matrix_.convex; }

 private:
  bool assemble_as(Equilibrium& equilibrium, const Configuration& at, bool convex, std::string& failure);

  BlockMatrix matrix_;
  SparseSolver solver_;
  double load_ = std::numeric_limits<double>::quiet_NaN();  ///< load parameter that indefinite_ tells of
  bool indefinite_ = false;                                 ///< far from equilibrium
  bool factorised_ = false;                                 ///< the matrix as it is
};

}  // namespace perikit
