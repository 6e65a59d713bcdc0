#pragma once
/// Linear systems of nearly incompressible bodies with the pressures of points as further unknowns.

#include <functional>

#include "perikit/sdk/equilibrium.hpp"
#include "preconditioner.hpp"
#include "volume_equations.hpp"

namespace perikit {

/// K u = r with K = A + B^T W B (VolumeEquations) and p = W B u is
///
///   [ A   B^T  ] [u]   [r]
///   [ B  -W^-1 ] [p] = [0],     A w = K w - B^T W B w,
///
/// for any B and W, so that the answer is that of the exact tangent. A Krylov method on it takes hardly more iterations where the
/// bulk modulus grows; on K alone it takes the root of it times as many, even with the exact inverse of A. The preconditioner is
/// the inverse of this matrix with M in place of A, as nearly as the Schur complement S = B M^-1 B^T + W^-1 can be solved:
///
///   v = M^-1 r_u,  S p = B v - r_p,  u = M^-1 (r_u - B^T p).
///
/// M^-1 is a multigrid cycle of the companion plus its inverse diagonal, since families resist short waves less than springs
/// between nearest neighbours do. With S exact, the increments that it gives keep B u = W^-1 p, and only how well M stands for A
/// counts: a third of the iterations that the upper triangle takes.
///
/// Vectors have `dimension` components of u and one of p. The second row is multiplied by row_scales() of the volume equations. All
/// ranks must call everything.
class MixedSystem {
 public:
  /// Kw <- K w on free components, 0 elsewhere; false where that fails.
  using Product = std::function<bool(ConstFieldView w, FieldView Kw)>;

  /// `chosen` gets how the companion is solved on several ranks.
  MixedSystem(Problem& problem, std::unique_ptr<VolumetricPart> volumes, std::string& chosen)
      : problem_(problem),
        volumes_(problem, std::move(volumes)),
        cycle_(make_companion_cycle(problem, VolumeEquations::ordinary, chosen)) {}

  Field make_vector() const { return problem_.points().make_field(problem_.dimension() + 1); }
  FieldView displacement(FieldView x) const { return {x.data, x.stride, x.components - 1}; }
  FieldView pressure(FieldView x) const { return {x.component(x.components - 1), x.stride, 1}; }

  /// The system and its preconditioner at u. False where u is inadmissible; `failure` says why.
  bool linearise(Equilibrium& equilibrium, ConstFieldView u, std::string& failure);
  /// As much of it as `correct` needs.
  bool linearise_volumes(Equilibrium& equilibrium, ConstFieldView u, std::string& failure);
  bool multiply(const Product& K, FieldView x, FieldView y);
  /// Aw <- A w.
  bool multiply_without_volumes(const Product& K, ConstFieldView w, FieldView Aw);
  void precondition(FieldView r, FieldView z);
  /// Iterations that a solve took to make its residual smaller by the factor `reduction` < 1.
  void took(int iterations, double reduction) { cycle_->took(iterations, reduction); }
  /// Bonds have changed: no more M of before.
  void discard() { cycle_->discard(); }
  /// W over the shear modulus, of the point where it is largest.
  double largest_ratio() const { return volumes_.largest_ratio(); }
  /// du += a motion after which the volumes at u + du are those that the linear equations promised (VolumeEquations::correct):
  /// W^-1 p of their solution (u, p), and B of what du has beyond it. The system is to be linearised afterwards.
  std::pair<double, double> correct(ConstFieldView u, FieldView solution, double enough, FieldView du);
  /// The same, to the volumes at u: what an extrapolated motion is to keep, because its own B du is an error of second order
  /// itself.
  std::pair<double, double> keep_volumes(ConstFieldView u, FieldView du);
  /// z <- M^-1 r; another field than r.
  void invert_companion(ConstFieldView r, FieldView z);

 private:
  Problem& problem_;
  VolumeEquations volumes_;
  BlockMatrix springs_;
  std::unique_ptr<Preconditioner> cycle_;
  Field rate_ = problem_.points().make_field(1), excess_ = problem_.points().make_field(1), force_ = problem_.make_field();
};

}  // namespace perikit
