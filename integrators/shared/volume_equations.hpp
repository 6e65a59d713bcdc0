#pragma once
/// Scalar equations for the volumes and pressures of points: what a mixed system is preconditioned with.

#include <memory>
#include <utility>

#include "perikit/core/block_matrix.hpp"
#include "perikit/problem/problem.hpp"

namespace perikit {

/// K = A + B^T W B at one state, B of VolumetricPart and W what of the stiffness of its points exceeds that of bulk moduli of
/// `ordinary` shear moduli: A is the tangent of a compressible body. Points without such an excess have W = 0 and no pressure.
/// With D the diagonal of a companion of A,
///
///   L = B D^-1 B^T + W^-1
///
/// is symmetric and positive definite, a product costs two passes over the bonds, and conjugate gradients solve it in 4 (bulk
/// modulus of 100 shear moduli) to 30 (10^4) of them to a tenth: point gradients smooth, so that short waves of volume rest on
/// W^-1 alone.
class VolumeEquations {
 public:
  static constexpr double ordinary = 5.0 / 3;  ///< lambda = mu: springs can be so stiff against changes of volume and no more

  VolumeEquations(Problem& problem, std::unique_ptr<VolumetricPart> volumes);
  /// B, W and D at u. `companion` approximates A, `free` is 1 on free components; both must outlive the equations at u.
  EvaluationStatus linearise(ConstFieldView u, const BlockMatrix& companion, ConstFieldView free);

  /// q <- B w where there is a pressure, 0 elsewhere.
  void rates(ConstFieldView w, FieldView q) const;
  /// f <- B^T q on free components, 0 elsewhere.
  void forces(ConstFieldView q, FieldView f) const;
  ConstFieldView stiffness() const { return W_; }
  ConstFieldView compliance() const { return inverse_W_; }  ///< W^-1; 0 where W = 0
  ConstFieldView active() const { return active_; }         ///< 1 where there is a pressure
  /// |b_i|, the Euclidean norms of the rows of B.
  ConstFieldView row_norms() const { return row_norms_; }

  /// W over shear modulus and volume, of the point where it is largest.
  double largest_ratio() const { return largest_ratio_; }

  /// p <- S^-1 r, S = B A^-1 B^T + W^-1 the Schur complement, by the least-squares commutator [Elman et al. 2006]:
  ///   S^-1 ~ L^-1 (B D^-1 A D^-1 B^T + W^-1) L^-1
  /// with the companion in place of A.
  void solve_schur(ConstFieldView r, FieldView p);

  /// Those that linear equations promised, ln Jbar(u) + B du, or those of u: what an extrapolated motion is to keep, because its own B du is
  /// an error of second order itself.
  enum class Volumes { promised, kept };

  /// du += the least motion, in the norm of D, after which ln Jbar(u + du) is that of `volumes`: the second-order correction of
  /// sequential quadratic programming [Nocedal and Wright, 18.3]. What a full step errs in volumes, which is of second order, the
  /// bulk modulus would turn into pressures far beyond the true ones. Stops where B^T W times the error is below `enough` [N], or
  /// the error no longer falls. B is that of another state afterwards. Returns the norms of the error before and after.
  std::pair<double, double> correct(ConstFieldView u, Volumes volumes, double enough, FieldView du);

 private:
  /// Of pressures that such errors of ln Jbar are, over the shear modulus.
  double largest_pressure(ConstFieldView error) const;
  double multiply(ConstFieldView p, FieldView Lp);
  void multiply_commutator(ConstFieldView p, FieldView Mp);
  /// b . diag(L)^-1 b
  double scaled_square(ConstFieldView b) const;
  /// x <- L^-1 b until the scaled square of the residual is that of b times accuracy^2.
  void solve(ConstFieldView b, double accuracy, FieldView x);
  /// The same from an x whose residual is in residual_, until its scaled square is at most `target`.
  void improve(double target, FieldView x);

  Problem& problem_;
  std::unique_ptr<VolumetricPart> volumes_;
  const BlockMatrix* companion_ = nullptr;
  ConstFieldView free_;
  double largest_ratio_ = 0;
  Field W_, inverse_W_, active_, row_norms_;
  Field inverse_D_;         ///< 0 on prescribed components
  Field inverse_diagonal_;  ///< of L
  Field force_, action_;
  Field residual_, direction_, product_;  ///< of conjugate gradients
  Field first_, second_;
};

}  // namespace perikit
