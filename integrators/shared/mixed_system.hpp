#pragma once
/// Linear systems of nearly incompressible bodies with the pressures of points as further unknowns.

#include <functional>

#include "multigrid.hpp"
#include "perikit/sdk/equilibrium.hpp"
#include "volume_equations.hpp"

namespace perikit {

/// K u = r with K = A + B^T W B (VolumeEquations) and p = W B u is
///
///   [ A   B^T  ] [u]   [r]
///   [ B  -W^-1 ] [p] = [0],     A w = K w - B^T W B w,
///
/// for any B and W, so that the answer is that of the exact tangent. A Krylov method on it takes hardly more iterations where the
/// bulk modulus grows; on K alone it takes the root of it times as many, even with the exact inverse of A. The preconditioner is
/// the upper triangle with -S, S the Schur complement, in place of -W^-1, and one multigrid cycle of a companion in place of
/// A^-1.
///
/// Vectors have `dimension` components of u and one of p. The second row is multiplied by W_i |b_i|, which makes the residual as
/// large as what its error in volumes is as a force: a small residual here is a small one of K u = r.
class MixedSystem {
 public:
  /// Kw <- K w on free components, 0 elsewhere; false where that fails.
  using Product = std::function<bool(ConstFieldView w, FieldView Kw)>;

  MixedSystem(Problem& problem, std::unique_ptr<VolumetricPart> volumes)
      : problem_(problem), volumes_(problem, std::move(volumes)) {}

  Field make_vector() const { return problem_.body().make_field(problem_.dimension() + 1); }
  FieldView displacement(FieldView x) const { return {x.data, x.stride, x.components - 1}; }
  FieldView pressure(FieldView x) const { return {x.component(x.components - 1), x.stride, 1}; }

  /// The system and its preconditioner at u. False where u is inadmissible; `failure` says why.
  bool linearise(Equilibrium& equilibrium, ConstFieldView u, std::string& failure);
  /// As much of it as `correct` needs.
  bool linearise_volumes(Equilibrium& equilibrium, ConstFieldView u, std::string& failure);
  bool multiply(const Product& K, FieldView x, FieldView y);
  void precondition(FieldView r, FieldView z);
  /// W over the shear modulus, of the point where it is largest.
  double largest_ratio() const { return volumes_.largest_ratio(); }
  /// See VolumeEquations::correct. The system is to be linearised afterwards.
  std::pair<double, double> correct(ConstFieldView u, VolumeEquations::Volumes volumes, double enough, FieldView du) {
    return volumes_.correct(u, volumes, enough, du);
  }

 private:
  Problem& problem_;
  VolumeEquations volumes_;
  BlockMatrix springs_;
  Multigrid multigrid_;
  Field rate_ = problem_.body().make_field(1), excess_ = problem_.body().make_field(1), force_ = problem_.make_field();
};

}  // namespace perikit
