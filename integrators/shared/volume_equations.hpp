#pragma once
/// Scalar equations for the volumes and pressures of points: what a mixed system is preconditioned with.

#include <memory>
#include <utility>

#include "perikit/core/block_matrix.hpp"
#include "perikit/problem/problem.hpp"
#include "wave_compliance.hpp"

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
  /// |b_i|, the norms of the rows of B, times what turns an error in volume into one of force that a solve is to count: W_i,
  /// which makes the residual as large as the force that it is, or where that is large a hundredth of it, since `correct` gives
  /// volumes more digits at less cost than GMRES does.
  ConstFieldView row_scales() const { return row_scales_; }

  /// D^-1, 0 on prescribed components.
  ConstFieldView inverse_diagonal() const { return inverse_D_; }

  /// W over shear modulus and volume, of the point where it is largest.
  double largest_ratio() const { return largest_ratio_; }

  /// p <- S^-1 r, S = B M^-1 B^T + W^-1 the Schur complement, by the least-squares commutator [Elman et al. 2006]:
  ///   S^-1 ~ L^-1 (B D^-1 M D^-1 B^T + W^-1) L^-1
  /// with M^-1 = C^-1 + D^-1, C the companion. Waves longer than about sqrt(W) points have B D^-1 B^T
  /// below W^-1, and pressures of B M^-1 B^T above it. So up to ratios of 1000, where bodies are as long as that,
  ///   S^-1 ~ L^-1 (B D^-1 M D^-1 B^T + R W R) L^-1,  L = B D^-1 B^T + R,
  /// R being W^-1 times the Laplacian that M D^-1 is to pressures (WaveCompliance).
  void solve_schur(ConstFieldView r, FieldView p);

  /// du += the least motion, in the norm of D, after which ln Jbar(u + du) is ln Jbar(u) + `growth`: the second-order correction
  /// of sequential quadratic programming [Nocedal and Wright, 18.3]. What a full step errs in volumes, which is of second order,
  /// the bulk modulus would turn into pressures far beyond the true ones. Stops where B^T W times the error is below `enough`
  /// [N], or the error no longer falls. B is that of another state afterwards. Returns the norms of the error before and after.
  std::pair<double, double> correct(ConstFieldView u, ConstFieldView growth, double enough, FieldView du);

 private:
  /// Of pressures that such errors of ln Jbar are, over the shear modulus.
  double largest_pressure(ConstFieldView error) const;
  /// Lp <- L p, with R in place of W^-1 for `waves`; p . L p.
  double multiply(ConstFieldView p, bool waves, FieldView Lp);
  void multiply_commutator(ConstFieldView p, FieldView Mp);
  /// b . diag(L)^-1 b
  double scaled_square(ConstFieldView b) const;
  /// x <- L^-1 b until the scaled square of the residual is that of b times accuracy^2.
  void solve(ConstFieldView b, double accuracy, bool waves, FieldView x);
  /// The same from an x whose residual is in residual_, until its scaled square is at most `target`.
  void improve(double target, bool waves, FieldView x);

  Problem& problem_;
  std::unique_ptr<VolumetricPart> volumes_;
  const BlockMatrix* companion_ = nullptr;
  ConstFieldView free_;
  double largest_ratio_ = 0;
  Field W_, inverse_W_, active_, row_scales_;
  Field inverse_D_;         ///< 0 on prescribed components
  Field inverse_diagonal_;  ///< of L
  Field force_, action_, power_;
  Field residual_, direction_, product_;  ///< of conjugate gradients
  Field first_, second_;
  WaveCompliance R_;
  bool waves_ = false;  ///< the Schur complement takes R
  Field compliant_;     ///< R p
};

}  // namespace perikit
