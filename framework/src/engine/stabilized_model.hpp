#pragma once
#include "perikit/engine/model.hpp"
#include "zero_energy_penalty.hpp"

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

 private:
  std::unique_ptr<Model> base_;
  std::unique_ptr<ZeroEnergyPenalty> penalty_;   ///< refers to base_
};

}  // namespace perikit
