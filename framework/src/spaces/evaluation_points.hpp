#pragma once
/// The evaluation points of one point at a time, each a stencil over the bonds of the point: for all that is no hot loop (assembled tangents, rows of volumes,
/// laminates). Spaces have the same evaluation points in the order of their loops.

#include <vector>

#include "perikit/core/parallel.hpp"
#include "spaces/bond_ends.hpp"
#include "spaces/bond_shape.hpp"
#include "spaces/evaluation_space.hpp"
#include "spaces/weighted/local_stencil.hpp"

namespace perikit {

/// Evaluation points q of a point p lie at its bonds, in the order of its family, at parts of the family, or at p itself. Gradients are g[k * D + e] over
/// the bonds k: H = sum_k (u_k - u_p) (x) g_k.
template <int D>
class EvaluationPoints {
 public:
  explicit EvaluationPoints(const SpaceParts& parts);

  /// Reads point p with its bonds of the set-up, failed ones with b = 0.
  void read(std::size_t p);

  const FamilyArrays& family() const noexcept { return family_; }
  std::size_t bonds() const noexcept { return family_.far.size(); }
  bool at_bonds() const noexcept { return parts_of_family_ == 0; }
  int points() const noexcept { return at_bonds() ? static_cast<int>(bonds()) : parts_of_family_; }
  /// The far end of the bond that q belongs to; -1: it belongs to a part or to the point.
  std::int32_t far(int q) const noexcept { return at_bonds() ? family_.far[static_cast<std::size_t>(q)] : -1; }
  /// W_q [m^3]; 0: the evaluation point stores nothing.
  double weight(int q);
  /// The gradient of the point itself.
  const double* own();
  /// The gradient of evaluation point q, of weighted kinematics with a selective map also that of the owner: q = -1. Not of bond shapes, whose H_b is
  /// that of bond_shape_row.
  const double* gradient(int q);
  /// Local force states: the stress of q acts on bond q alone, with this factor on g_qq. Else empty.
  const std::vector<double>& tested();
  // Bond shapes: how much A has of the gradients of both ends, and g_b.
  EndShares shares(int q) const noexcept;
  void correction(int q, double (&g)[D]);

  /// H of a field of one component at evaluation point q. value(p): at points; own(p): its gradient at them, which bond shapes read.
  template <class Value, class Own>
  void gradient_of(int q, const Value& value, const Own& own, double (&H)[D]) {
    if (!parts_.formulation.bond) return sum(gradient(q), value, H);
    const auto k = static_cast<std::size_t>(q);
    const auto far = static_cast<std::size_t>(family_.far[k]);
    const EndShares ends = shares(q);
    const double *const near_H = own(p_), *const far_H = own(far);
    double A[D], xi[D], g[D];
    correction(q, g);
    for (std::size_t e = 0; e < D; ++e) {
      A[e] = ends.near * near_H[e] + ends.far * far_H[e];
      xi[e] = family_.xi[e][k];
    }
    bond_shape_row<D>(A, value(far) - value(p_), xi, g, H);
  }
  /// The same by a stencil over the bonds.
  template <class Value>
  void sum(const double* g, const Value& value, double (&H)[D]) const {
    std::fill_n(H, D, 0.0);
    const double own = value(p_);
    for (std::size_t k = 0; k < bonds(); ++k) {
      const double difference = value(static_cast<std::size_t>(family_.far[k])) - own;
      for (std::size_t e = 0; e < D; ++e) H[e] += g[k * D + e] * difference;
    }
  }

 private:
  /// Makes the stencils of weighted kinematics.
  void make_weighted();

  SpaceParts parts_;
  int parts_of_family_;
  std::size_t p_ = 0;
  bool whole_ = false;      ///< p has the whole family of a lattice: all such points have the same stencils
  bool own_made_ = false, weighted_made_ = false, corrected_ = false;
  FamilyArrays family_;
  AlignedVector<double> share_, correction_;
  LocalStencil<D> stencil_;
  std::vector<double> own_, weighted_;
};

}  // namespace perikit
