#include "perikit/problem/damaged_part.hpp"

#include "perikit/core/field_operations.hpp"
#include "perikit/problem/body_problem.hpp"

namespace perikit {

class BodyProblem::Damaged final : public DamagedPart {
 public:
  Damaged(BodyProblem& problem, GroupRings groups) : problem_(problem), groups_(std::move(groups)), inside_(problem.make_field()) {
    for (const std::int32_t p : problem_.body().owned())
      for (int c = 0; c < inside_.components() && groups_.inside[static_cast<std::size_t>(p) / padding]; ++c) inside_.component(c)[p] = 1;
  }

  ConstFieldView inside() const override { return inside_; }

  EvaluationStatus tangent_action(ConstFieldView u, ConstFieldView w, FieldView Kw) override {
    EvaluationStatus status =
        problem_.terms().tangent_of(groups_, problem_.seen(u, problem_.seen_), problem_.seen(w, problem_.seen_direction_), Kw);
    problem_.describe(status);
    problem_.finish(Kw, status);
    return status;
  }

 private:
  BodyProblem& problem_;
  GroupRings groups_;
  Field inside_;
};

std::unique_ptr<DamagedPart> BodyProblem::damaged_part() {
  // Forces on images go to sources elsewhere.
  if (!parts_.fracture.damage() || images()) return nullptr;
  GroupRings groups = terms().near_failed_bonds();
  if (groups.inside.empty()) return nullptr;
  return std::make_unique<Damaged>(*this, std::move(groups));
}

}  // namespace perikit
