#pragma once
#include "assembly/volumetric_rows.hpp"
#include "cloud_balance/consistency.hpp"
#include "operators/law_history.hpp"
#include "spaces/evaluation_space.hpp"
#include "terms/term.hpp"

namespace perikit {

/// Laws at the evaluation points of a space: E = sum_q W_q psi(F_q), with the map between the gradients of the space and those of
/// the laws. Force, tangent action, energy and samples stand here once, for every space.
class Mechanics final : public Term {
 public:
  explicit Mechanics(const SpaceParts& parts);

  std::int64_t add_forces(ConstFieldView u, FieldView force, ExactSum* energy) override {
    return forces(u, force, energy, {});
  }
  std::int64_t add_forces_meanwhile(Arrival& arrival, ConstFieldView u, FieldView force, ExactSum* energy) override {
    return forces(u, force, energy, {.arrival = &arrival});
  }
  std::int64_t move_and_add_forces(PointMotion& motion, ConstFieldView u, FieldView force, ExactSum* energy) override {
    return forces(u, force, energy, {.motion = &motion});
  }
  std::int64_t add_forces_and_samples(ConstFieldView u, FieldView force, ExactSum* energy, PointSamples& samples) override;
  std::int64_t add_tangent(ConstFieldView u, ConstFieldView w, FieldView Kw) override {
    return tangent_of(u, w, Kw, nullptr, nullptr);
  }
  std::int64_t add_samples(ConstFieldView u, PointSamples& samples) override;
  int coupling_reach() const noexcept override;
  std::unique_ptr<Assembly> make_assembly(const BlockRows& rows) const override;
  std::int64_t add_forces_of(ConstFieldView u, const GroupMarks& only, const GroupMarks& near, FieldView force,
                             ExactSum* energy) override;
  void complete(GroupMarks& marks) const override { space_->complete(marks); }
  std::int64_t renew_forces(ConstFieldView u, const GroupMarks& only, const GroupMarks& complete, const GroupMarks& near, FieldView force,
                            ExactSum& energy) override;
  std::int64_t add_tangent_of(ConstFieldView u, ConstFieldView w, const GroupMarks& only, const GroupMarks& near,
                              FieldView Kw) override {
    return tangent_of(u, w, Kw, only.data(), near.data());
  }
  void add_bonds(ConstFieldView u, const GroupMarks& marks, const GroupMarks& near, BondSamples& samples) override;
  void bonds_changed(std::span<const std::int32_t> points) override;
  const NearestFailure* watch(const BodyDamage&) override { return nullptr; }
  PointFlux point_flux() const noexcept override { return space_->point_flux(); }
  bool screen(BondScreen* screen) override {
    screen_ = screen;
    return true;
  }
  void report(ModelReport& report) const override;
  RestingCounts resting_counts() const noexcept override { return space_->resting_counts(); }

  /// Of the laws; null where none has one.
  LawHistory* history() noexcept { return history_.get(); }
  /// What laws dissipate on this rank in the step that the last evaluation of forces ended; once.
  ExactSum take_dissipated() { return std::exchange(dissipated_, {}); }
  /// A constant stress is in equilibrium from now on, where the body is whole.
  void balance(std::shared_ptr<CloudConsistency> consistency);
  void history_restored() { space_->history_restored(); }
  /// The evaluation points here that keep a history, ascending.
  std::vector<HistoryPlace> history_points();
  /// Null where volumes are not those of point gradients. The rows must not outlive this.
  std::unique_ptr<VolumetricRows> make_volumetric_rows();

 private:
  /// What an evaluation of forces does beside; null: nothing.
  struct Beside {
    Arrival* arrival = nullptr;
    PointMotion* motion = nullptr;
    const SampleSums* samples = nullptr;   ///< that it takes along
  };
  std::int64_t forces(ConstFieldView u, FieldView force, ExactSum* energy, const Beside& beside);
  std::int64_t tangent_of(ConstFieldView u, ConstFieldView w, FieldView Kw, const std::uint8_t* only, const std::uint8_t* near);
  BatchWork work(Work kind, bool energy, BondScreen* screen = nullptr) const noexcept;
  /// Looks for laminates among the evaluation points of the groups marked. again: there may have been others.
  void find_laminates(GroupMarks marks, bool again);
  class LaminateVolumes;
  /// stiffness <- that of the volumes of points whose evaluation points may be laminates (VolumetricRows), where it is not 0. Field index of
  /// an inadmissible point, or -1.
  std::int64_t stiffness_near_laminates(ConstFieldView u, FieldView stiffness);
  std::vector<LaminateFinder::Found> gradients_of(const Field& values, int keep, const GroupMarks& marks, const GroupMarks& near,
                                                 bool with_weightless = false);
  /// Room for the energies of all groups, zero.
  std::vector<GroupEnergy> no_energies() const { return std::vector<GroupEnergy>(parts_.families.body().stride() / padding); }
  /// Of what this rank owns.
  void add_owned(const std::vector<GroupEnergy>& energies, double GroupEnergy::* which, ExactSum& sum) const;

  SpaceParts parts_;
  std::unique_ptr<EvaluationSpace> space_;
  std::unique_ptr<LawHistory> history_;
  std::unique_ptr<Laminates> laminates_;
  BondScreen* screen_ = nullptr;
  std::vector<GroupEnergy> energies_;  ///< of the last forces with an energy
  ExactSum dissipated_;
  std::shared_ptr<const CloudConsistency> consistency_;
};

}  // namespace perikit
