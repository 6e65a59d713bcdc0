#pragma once
#include "cloud_balance/consistency.hpp"
#include "spaces/evaluation_space.hpp"
#include "terms/term.hpp"

namespace perikit {

template <int D>
class EvaluationPoints;

/// Laws at the evaluation points of a space: E = sum_q W_q psi(F_q), with the map between the gradients of the space and those of
/// the laws. Force, tangent action, energy and samples stand here once, for every space.
class Mechanics final : public Term, public AssembledTerm, public SampledTerm, public BreakableTerm, public StatefulTerm {
 public:
  explicit Mechanics(const SpaceParts& parts);

  std::int64_t forces(const Configuration& at, const Region& region, const ForceSum& sum) override {
    return add_forces(at, region, sum, nullptr);
  }
  std::int64_t tangent(const Configuration& at, ConstFieldView w, const Region& region, FieldView Kw) override;
  void report(ModelReport& report) const override;
  bool constant_tangent() const noexcept override { return parts_.laws.constant_tangent(); }
  AssembledTerm* assembled() noexcept override { return this; }
  SampledTerm* sampled() noexcept override { return this; }
  BreakableTerm* breakable() noexcept override { return this; }
  StatefulTerm* stateful() noexcept override { return points_->remember() ? this : nullptr; }

  int coupling_reach() const noexcept override;
  std::unique_ptr<Assembly> make_assembly(const BlockRows& rows) override;
  std::unique_ptr<VolumetricRows> make_volumetric_rows() override;
  std::int64_t sample(const Configuration& at, PointSamples& samples) override;
  std::int64_t forces_and_samples(const Configuration& at, const ForceSum& sum, PointSamples& samples) override;
  void bonds_changed(std::span<const std::int32_t> points) override;
  void complete(GroupMarks& marks) const override { space_->complete(marks); }
  void add_bonds(const Configuration& at, const Region& region, BondSamples& samples) override;
  PointFlux point_flux() const noexcept override { return space_->point_flux(); }
  MaterialPoints& points() noexcept override { return *points_; }
  void history_restored() override { space_->history_restored(); }
  std::vector<HistoryPlace> history_points() override;
  void average_state(std::string_view name, std::size_t components, std::span<const std::int32_t> points, std::span<double> to) override;
  ShorterStep shorter_step() override;
  bool dissipates() const noexcept override { return parts_.laws.dissipates(); }

  /// A constant stress is in equilibrium from now on, where the body is whole.
  void balance(std::shared_ptr<CloudConsistency> consistency);

 private:
  /// samples: taken along; null: none.
  std::int64_t add_forces(const Configuration& at, const Region& region, const ForceSum& sum, const SampleSums* samples);
  BatchWork work(const Configuration& at, BatchTask task) const noexcept;
  /// Looks for laminates among the evaluation points of the points marked. again: there may have been others.
  void find_laminates(GroupMarks marks, bool again);
  template <int D>
  std::vector<HistoryPlace> history_points();
  template <int D>
  void average_state(std::string_view name, std::size_t components, std::span<const std::int32_t> points, std::span<double> to) const;
  /// visit(q, weight, number) of each evaluation point of p that remembers something and has a weight; one of p itself has it with or without bonds.
  template <int D, class Visit>
  void over_states(std::int32_t p, EvaluationPoints<D>& reader, Visit&& visit) const;
  /// The shortest step that is asked for at evaluation points of this rank which have a gradient.
  template <int D>
  ShorterStep shortest(std::vector<MaterialPoints::TooLong> asked) const;

  ShorterStep shorter_;   ///< of the last evaluation of forces

  SpaceParts parts_;
  std::unique_ptr<EvaluationSpace> space_;
  std::unique_ptr<MaterialPoints> points_;
  std::unique_ptr<Laminates> laminates_;
  std::shared_ptr<const CloudConsistency> consistency_;
};

}  // namespace perikit
