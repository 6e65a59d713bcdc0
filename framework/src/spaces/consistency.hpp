#pragma once
/// Weights of evaluation points with which a constant stress is in equilibrium inside of a cloud, as it is on a lattice.
///
/// Under a constant stress P a point k feels P A_k, A_k = sum_q W_q g_qk, which has no reason to vanish where points lie at
/// random. The weights w_q = W_q f_q nearest to W_q, in the sense of sum_q W_q (f_q - 1)^2, under
///
///   sum_q w_q g_qk = 0 for all points k whose surroundings are closed,     sum of w_q over the q of point i = that of W_q for
///   all
///   i
///
/// are f_q = 1 + tr H_q[lambda] + mu_i: the first constraint is the adjoint of the space applied to the unit stress, and the
/// transpose of that is the trace of the gradient of a field lambda, zero where a point is not closed. One pass of the space is
/// therefore a product with the matrix of the system for (lambda, mu), which conjugate gradients solve.

#include <functional>
#include <string>
#include <vector>

#include "perikit/body/body.hpp"
#include "perikit/operators/report.hpp"
#include "spaces/evaluation_space.hpp"

namespace perikit {

/// What became of a system.
struct Balanced {
  int iterations = 0;
  double before = 0, after = 0;  ///< largest |A_k| of closed components, over volume divided by spacing
  Point worst{};                 ///< where `after` is
};

struct CloudConsistency {
  /// Of images, where the body has some: u of real points -> u of images; forces on images -> forces on their sources; values of
  /// sources -> images.
  std::function<void(FieldView)> extend, fold, copy_from_sources;

  bool found = false;
  AlignedVector<double> factors;  ///< f_q by number of the evaluation point; empty where there are none to choose
  Field shift;                    ///< of point gradients (spaces/shift.hpp); no components where they stay
  std::size_t whole = 0;          ///< points k with all components of A_k
  std::size_t at_surfaces = 0;    ///< with the components along surfaces (closed_points.hpp)
  Balanced weights, gradients;
  int rounds = 0;
  double smallest = 1, largest = 1;  ///< f_q
  std::size_t bounded = 0;           ///< evaluation points at the lowest factor
  double seconds = 0;

  void report(ModelReport& report) const;
};

/// Factors below this are bounded.
inline constexpr double lowest_factor = 0.05;

/// Fills what is to be found, and gives it to the space. Clouds only.
void find_consistency(const SpaceParts& parts, EvaluationSpace& space, CloudConsistency& out);

}  // namespace perikit
