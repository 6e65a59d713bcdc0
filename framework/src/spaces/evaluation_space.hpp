#pragma once
/// Evaluation points of a body: where gradients are taken and laws evaluated. A space visits them batch by batch,
///
///   u -> H = F - I (its stencils)  ->  the operator, once for all spaces (operators/batch.hpp)  ->  its adjoint: forces,
///
/// and gives each a stable number, by which the history of laws is kept.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "families/families.hpp"
#include "families/resting_blocks.hpp"
#include "model/formulation.hpp"
#include "operators/batch.hpp"
#include "operators/point_flux.hpp"
#include "operators/report.hpp"

namespace perikit {

/// Where what belongs to an evaluation point is kept; -1: nowhere.
struct PointNumbers {
  std::int64_t point = -1;  ///< of the evaluation point: the same from both ends of a bond that is evaluated once
  std::int64_t state = -1;  ///< of what the law of this end remembers of it
};

class EvaluationSpace {
 public:
  virtual ~EvaluationSpace() = default;
  /// Visits the evaluation points, block by block. Adds what they do to pass.out, unless the pass is alone. What arrives has arrived then.
  virtual void run(Pass& pass) = 0;
  /// Runs with Work::force move the points of Pass::motion, all of them.
  virtual bool moves_points() const noexcept { return false; }
  /// Runs with Work::force may take samples along (BatchWork::sample_along), of bodies without histories and laminates.
  virtual bool samples_along() const noexcept { return false; }
  /// Marks the points whose energies a run sums up together with those of marked ones (Pass::energies).
  virtual void complete(GroupMarks& marks) const { mark_whole_runs(1, marks); }
  /// The numbers of evaluation points lie below this.
  virtual std::size_t numbers() const noexcept = 0;
  /// Numbers of an evaluation point of p: of its bond to `far`, or else (far = -1) of that part of its family. Only where numbers are asked for
  /// (SpaceParts::numbered).
  virtual PointNumbers number_of(std::int32_t p, std::int32_t far, int part) const noexcept = 0;
  /// This rank evaluates what belongs to p.
  virtual bool evaluates(std::size_t) const noexcept { return true; }
  /// What follows from the bonds of these points is to be made anew.
  virtual void bonds_changed(std::span<const std::int32_t> points) = 0;
  /// Weights of evaluation points may be multiplied by factors, of which there are so many; 0: they may not. Bonds of a cloud: by
  /// place in the lists of the set-up.
  virtual std::size_t factors() const noexcept { return 0; }
  /// From now on W_q times factors[q]; empty: 1. They must outlive the space.
  virtual void set_factors(std::span<const double>) {}
  /// Point gradients of order 1 on clouds, and those of parts of families: shifted by this field from now on (spaces/shift.hpp). It
  /// must outlive the space.
  virtual void shift_gradients(ConstFieldView) {}
  /// Of the last run, where that was an evaluation of forces.
  virtual PointFlux point_flux() const noexcept { return {}; }
  /// Adds bytes, counts and notes of what is left out.
  virtual void report(ModelReport& report) const = 0;
  /// The history of laws was replaced.
  void history_restored() { quiet_.stay_awake(); }
  RestingCounts resting_counts() const noexcept { return quiet_.counts(); }

 protected:
  RestingBlocks quiet_;
};

/// What a space is made of. All but the kinematics must outlive it.
struct SpaceParts {
  const Families& families;
  const Formulation& formulation;
  const Laws& laws;
  bool skip = true;                      ///< leave out work whose result is known; changes no bit
  bool share = true;                     ///< savings by symmetry and uniformity; change rounding
  std::span<const double> factors = {};  ///< of the weights, as set_factors takes them; for assemblies
  std::shared_ptr<const Interfaces> interfaces = {};  ///< null: no laminates

  ConstFieldView shift = {};  ///< of gradients, as shift_gradients takes it; for assemblies
  bool history() const noexcept { return laws.state_components() > 0; }
  /// Evaluation points need numbers.
  bool numbered() const noexcept { return history() || interfaces; }
  /// A bond has one evaluation point for both ends.
  bool bonds_once() const noexcept { return formulation.pair_symmetric && share; }
  /// None where laws may be stressed at rest.
  RestingBlocks quiet_blocks(const BlockReach& reach) const { return skip && !laws.read_external() ? RestingBlocks(reach, history()) : RestingBlocks(); }
};

/// The space of these parts on a body of D dimensions.
template <int D>
std::unique_ptr<EvaluationSpace> make_space(const SpaceParts& parts);

}  // namespace perikit
