#pragma once
/// Exact tangents of evaluation points: gradients are collected lane by lane and go to the materials in full batches.

#include <memory>
#include <vector>

#include "operators/laminates.hpp"
#include "operators/material_points.hpp"
#include "perikit/model/configuration.hpp"
#include "spaces/evaluation_space.hpp"

namespace perikit {

/// The laws at the evaluation points of a space: what they remember, and which of the points are laminates (null: none).
struct LawsOfSpace {
  const MaterialPoints& points;
  const EvaluationSpace& space;
  const Laminates* laminates;
};

/// Matrices over in-space components, row-major: entry (aD + e, bD + f) couples P_ae with F_bf. With the selective map stresses act on
/// and depend on Ft, the point's own gradient, and Fbar, the owner's.
template <int D>
class TangentBatch {
 public:
  static constexpr int components = D * D, entries = components * components;

  TangentBatch(const LawsOfSpace& laws, bool selective);
  void clear() noexcept {
    lanes_ = 0;
    laminates_.clear();
  }
  int lanes() const noexcept { return lanes_; }
  /// A lane for an evaluation point of W = weight [m^3], at the bond of `owner` to `far` or, where far is -1, at a part of its family; its gradients are to
  /// be filled in. It has the state of the beginning of the step. share: c of the selective map.
  int add(std::size_t owner, std::int32_t far, int part, double weight, double share);
  /// Component aD + e of Ht, and of the owner's Hbar (selective map only).
  double& H(int lane, int component) noexcept { return at(H_, lane, component); }
  double& owner_H(int lane, int component) noexcept { return at(Hbar_, lane, component); }
  /// Returns the first inadmissible lane or -1. at: what laws know beside the gradients, the length of the step that ends there and variables from outside. convex: the matrices of each lane together lose
  /// their negative eigenvalues.
  int evaluate(const Configuration& at, bool convex = false);
  /// Selective map, of no more than batch_points lanes: W times the volume stiffness at the mapped gradient (operators/volume_stiffness.hpp).
  double volume_stiffness(int lane) const noexcept;
  int owner(int lane) const noexcept { return owner_[static_cast<std::size_t>(lane)]; }
  /// W dP/dFt, W dP/dFbar, W dPbar/dFt, W dPbar/dFbar: see selective_tangent.
  double* own(int lane) noexcept { return own_.data() + static_cast<std::size_t>(lane) * entries; }
  const double* own(int lane) const noexcept { return own_.data() + static_cast<std::size_t>(lane) * entries; }
  const double* mixed(int lane) const noexcept { return mixed_.data() + static_cast<std::size_t>(lane) * entries; }
  const double* back(int lane) const noexcept { return back_.data() + static_cast<std::size_t>(lane) * entries; }
  const double* bar(int lane) const noexcept { return bar_.data() + static_cast<std::size_t>(lane) * entries; }

 private:
  static constexpr int stored = 9;  ///< components of a gradient with the lateral ones
  double& at(AlignedVector<double>& x, int lane, int component) noexcept {
    return x[static_cast<std::size_t>((lane / batch_points * stored + component) * batch_points + lane % batch_points)];
  }
  int evaluate_plain(int first, int n, const Configuration& at);
  int evaluate_selective(int first, int n, const Configuration& at);
  /// Of the laws of these lanes, without what goes in and comes out.
  LawBatch batch_of(int first, int n, const Configuration& at);
  int evaluate_laminates(int first, int n, const double* H);
  void remove_negative_curvature(int lane);

  LawsOfSpace of_;
  const MaterialPoints& points_;
  const Laws& laws_;
  bool selective_;
  int lanes_ = 0;
  AlignedVector<double> H_, Hbar_;   ///< batches of [component][batch_points]
  std::vector<std::int32_t> owner_, far_;  ///< padded to batches; far: -1 where a lane belongs to its owner alone
  std::vector<double> weight_, share_;   ///< by lane
  std::vector<std::int64_t> number_;     ///< likewise, where something is remembered
  AlignedVector<double> state_;          ///< of a batch
  AlignedVector<double> own_, mixed_, back_, bar_;
  AlignedVector<double> A_, P_, mapped_, growth_, inverse_, volume_;
  std::vector<std::int64_t> volume_group_;
  LawScratch scratch_;
  struct Laminate {
    int lane;
    LaminatePoint point;
  };
  std::vector<Laminate> laminates_;   ///< ascending by lane
  std::unique_ptr<LaminateScratch> laminate_scratch_;
};

}  // namespace perikit
