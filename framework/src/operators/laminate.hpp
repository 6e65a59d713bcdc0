#pragma once
/// Evaluation points that two materials share, as laminates. For a flat interface with normal n near q, a field that is affine on
/// either side with the jump a (x) n of its gradient gives
///   H_1 = H_q - a (x) g_1,   H_2 = H_q - a (x) g_2,   g_1 = (1 - theta) n,   g_2 = -theta n,
/// where theta, the share of the first material, is 1 - n . gamma and gamma the stencil of q applied to the positive part of the
/// distance from the interface. The laminate takes the a that stores least:
///   psi_q = min over a of theta psi_1(H_1) + (1 - theta) psi_2(H_2),   P_q = theta P_1 + (1 - theta) P_2.

#include <cstdint>
#include <memory>

#include "perikit/operators/laws.hpp"

namespace perikit {

struct LaminatePoint {
  double share = -1;            ///< theta; negative: none
  double direction[2][3] = {};  ///< g_1, g_2 [-]
  std::uint16_t material[2] = {0, 0};
  std::int32_t point[2] = {-1, -1};  ///< where the constants of either law are taken
};

/// plus, minus: the stencil applied to the positive and to the negative part of the distance. False where the materials do not
/// meet in one flat piece of interface, as far as the stencil sees.
bool make_laminate(int dimension, const double* plus, const double* minus, LaminatePoint& out) noexcept;

/// What is wanted of lanes of a batch; arrays have stride batch_points, null: not wanted.
struct LaminateBatch {
  int n = 0;
  const int* lane = nullptr;                       ///< of each of the n points
  const LaminatePoint* const* laminate = nullptr;  ///< of each of the n points
  const double* H = nullptr;
  const double* dH = nullptr;
  bool confined = false;
  double* psi = nullptr;
  double* P = nullptr;
  double* dP = nullptr;
  double* A = nullptr;  ///< as in LawBatch
  double* lateral = nullptr;
};

/// Memory of one thread.
class LaminateScratch {
 public:
  explicit LaminateScratch(const Laws& laws);
  /// Writes the lanes of the batch and no others. Returns the first lane without a solution: an inadmissible deformation, or no a
  /// that stores least.
  int evaluate(const LaminateBatch& batch);

 private:
  /// The iteration of one point.
  struct Search {
    double jump[3], direction[3], gradient[3], factor[6];
    double energy, step, size;
    bool done;
  };
  struct Side {
    alignas(64) double H[9 * batch_points];
    alignas(64) double P[9 * batch_points];
    alignas(64) double psi[batch_points];
    alignas(64) double lateral[batch_points];
    AlignedVector<double> A;
    std::int32_t point[batch_points];
  };

  int evaluate_together(const LaminateBatch& batch, int first, int n);
  void place(const LaminateBatch& batch, int first, int k) noexcept;
  int evaluate_laws(int n, bool confined, std::uint16_t first, std::uint16_t second);
  bool look(const LaminatePoint& laminate, int k, int iteration) noexcept;
  void mixed_tangent(const LaminatePoint& laminate, int k, double (&B)[3][9]) const noexcept;
  void write(const LaminateBatch& batch, int first, int k) const noexcept;

  const Laws& laws_;
  int dimension_, components_;
  LawScratch law_;
  Side side_[2];
  Search search_[batch_points];
};

}  // namespace perikit
