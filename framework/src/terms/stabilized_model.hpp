#pragma once
#include "perikit/terms/model.hpp"
#include "terms/zero_energy_penalty.hpp"

namespace perikit {

/// A model and a zero-energy penalty on top of it.
class StabilizedModel final : public Model {
 public:
  StabilizedModel(std::unique_ptr<Model> base, std::unique_ptr<ZeroEnergyPenalty> penalty)
      : base_(std::move(base)), penalty_(std::move(penalty)) {}

  EvaluationStatus forces(ConstFieldView u, FieldView force, double* energy) override;
  EvaluationStatus tangent(ConstFieldView u, ConstFieldView w, FieldView Kw) override;
  /// The base assembles the penalty with its own elements.
  EvaluationStatus assemble(ConstFieldView u, BlockMatrix& K) override { return base_->assemble(u, K); }
  AssembledSize assembled_size() override { return base_->assembled_size(); }
  EvaluationStatus sample(ConstFieldView u, PointSamples& samples) override;
  Field shape_tensor_condition() override { return base_->shape_tensor_condition(); }
  Field damage() override { return base_->damage(); }
  ModelReport report() const override;
  QuietCounts quiet_counts() const override { return base_->quiet_counts(); }
  /// The base knows the penalty, and its bonds are those of both.
  BondUpdate update_bonds(ConstFieldView u, const Motion& motion = {}) override { return base_->update_bonds(u, motion); }
  std::vector<BondChange> changed_bonds() const override { return base_->changed_bonds(); }
  void restore_bonds(std::span<const BondChange> changes) override { base_->restore_bonds(changes); }
  BondChecks bond_checks() const override { return base_->bond_checks(); }

 private:
  std::unique_ptr<Model> base_;
  std::unique_ptr<ZeroEnergyPenalty> penalty_;   ///< refers to base_
};

}  // namespace perikit
