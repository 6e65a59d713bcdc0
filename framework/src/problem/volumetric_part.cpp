#include "perikit/problem/volumetric_part.hpp"

#include "assembly/volumetric_rows.hpp"
#include "problem/body_problem.hpp"

namespace perikit {

/// Rows over all points that the terms see, between displacements and forces of the problem.
class BodyProblem::Volumes final : public VolumetricPart {
 public:
  Volumes(BodyProblem& problem, std::unique_ptr<VolumetricRows> rows)
      : problem_(problem), rows_(std::move(rows)), surroundings_(problem.surroundings_) {}

  EvaluationStatus linearise(ConstFieldView u) override {
    EvaluationStatus status = problem_.terms().status(rows_->linearise(surroundings_.seen(u, memory_)));
    surroundings_.finish({}, status);
    return status;
  }
  void rates(ConstFieldView w, FieldView q) const override { own(q, [&] { rows_->rates(surroundings_.seen(w, memory_), q); }); }
  void forces(ConstFieldView q, FieldView f) const override {
    rows_->forces(surroundings_.shared(q), f);
    surroundings_.settle(f);
  }
  void squares(ConstFieldView c, FieldView q) const override { own(q, [&] { rows_->squares(surroundings_.shared(c), q); }); }
  ConstFieldView logarithms() const override { return rows_->logarithms(); }
  ConstFieldView stiffness() const override { return rows_->stiffness(); }

 private:
  template <class Fill>
  void own(FieldView q, Fill&& fill) const {
    fill();
    if (surroundings_.ghosts()) surroundings_.ghosts()->clear(q);
  }

  BodyProblem& problem_;
  std::unique_ptr<VolumetricRows> rows_;
  Surroundings& surroundings_;
  mutable Field memory_;
};

std::unique_ptr<VolumetricPart> BodyProblem::volumetric_part() {
  std::unique_ptr<VolumetricRows> rows = terms().volumetric_rows();
  return rows ? std::make_unique<Volumes>(*this, std::move(rows)) : nullptr;
}

}  // namespace perikit
