#pragma once
/// Weights of evaluation points with which a constant stress is in equilibrium inside of a cloud, as it is on a lattice.
///
/// Under a constant stress P a point k feels P A_k, A_k = sum_q W_q g_qk, which has no reason to vanish where points lie at
/// random. The weights w_q = W_q f_q nearest to W_q, in the sense of sum_q W_q phi(f_q), phi(f) = (f^2 - 1)/4 - ln(f)/2, under
///
///   sum_q w_q g_qk = 0 for all points k whose surroundings are closed,
///   sum of w_q over the q of point i = that of W_q for all i
///
/// fulfil phi'(f_q) = (f_q - 1/f_q)/2 = tr H_q[lambda] + mu_i: the first constraint is the adjoint of the space applied to the
/// unit stress, and the transpose of that is the trace of the gradient of a field lambda, zero where a point is not closed. phi is
/// (f - 1)^2/2 near f = 1 and infinite at f = 0, so that weights stay positive. Newton's method finds (lambda, mu); one pass of
/// the space is a product with the matrix of its system, which conjugate gradients solve.

#include <functional>
#include <string>
#include <vector>

#include "operators/report.hpp"
#include "perikit/body/body.hpp"
#include "spaces/evaluation_space.hpp"

namespace perikit {

/// What became of a system.
struct Balanced {
  int iterations = 0;
  double before = 0, after = 0;  ///< largest |A_k| of closed components, over volume divided by spacing
  Point worst{};                 ///< where `after` is
  double moved = 0;              ///< gradients: by how much, root mean square over what they were
};

struct CloudConsistency {
  /// Of images and of points that other ranks own, where the body has some: u of the points of this rank -> u of those; forces on
  /// images -> forces on their sources, forces on points of others -> 0; values of sources and owners -> images and copies.
  std::function<void(FieldView)> extend, fold, copy_from_sources;

  bool found = false;
  AlignedVector<double> factors;  ///< f_q by number of the evaluation point; empty where there are none to choose
  Field shift;                    ///< of point gradients, then of those of parts (spaces/shift.hpp); no components where they stay
  std::size_t whole = 0;          ///< points k with all components of A_k
  std::size_t unbalanced = 0;     ///< of them, that had to be let go
  std::size_t at_surfaces = 0;    ///< with the components along surfaces (closed_points.hpp)
  Balanced weights, gradients;
  int rounds = 0;
  double smallest = 1, largest = 1;  ///< f_q
  double seconds = 0;
  std::function<void(double)> show_share;  ///< told of the share of the search for f_q that is done, on the way to rounding; empty: nobody

  void report(ModelReport& report) const;
};

/// By point: 1 where its evaluation points store energy.
std::vector<std::uint8_t> storing_points(const SpaceParts& parts);

struct BalanceEffort;
/// Small clouds come to rounding within two or three seconds. The same on any number of ranks, which all must call it.
BalanceEffort effort_of_balance(const SpaceParts& parts);

/// Fills what is to be found, and gives it to the space. Clouds only. All ranks must call it.
void find_consistency(const SpaceParts& parts, EvaluationSpace& space, CloudConsistency& out);

}  // namespace perikit
