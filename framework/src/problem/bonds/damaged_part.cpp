#include "perikit/problem/damaged_part.hpp"

#include "perikit/core/communicator.hpp"
#include "perikit/core/field_operations.hpp"
#include "problem/body_problem.hpp"

namespace perikit {

class BodyProblem::Damaged final : public DamagedPart {
 public:
  /// whole: the part is the whole body, whatever the points.
  Damaged(BodyProblem& problem, StiffenedPoints points, bool whole) : problem_(problem), points_(std::move(points)), whole_(whole), inside_(problem.make_field()) {
    for (const std::int32_t p : problem_.body().owned())
      for (int c = 0; c < inside_.components(); ++c) inside_.component(c)[p] = whole || points_.inside[static_cast<std::size_t>(p)] ? 1 : 0;
  }

  ConstFieldView inside() const override { return inside_; }

  EvaluationStatus tangent_action(const Configuration& at, ConstFieldView w, FieldView Kw) override {
    if (whole_) return problem_.tangent_action(at, w, Kw);
    EvaluationStatus status =
        problem_.terms().tangent(at.moved_to(problem_.seen(at.u(), problem_.seen_)), problem_.seen(w, problem_.seen_direction_), Kw, points_.region);
    problem_.describe(status);
    problem_.finish(Kw, status);
    return status;
  }

 private:
  BodyProblem& problem_;
  StiffenedPoints points_;
  bool whole_;
  Field inside_;
};

std::unique_ptr<DamagedPart> BodyProblem::damaged_part() {
  if (!parts_.fracture) return nullptr;
  StiffenedPoints points = parts_.fracture->stiffened_points();
  if (communicator().largest(points.inside.empty() ? 0 : 1) == 0) return nullptr;
  // Forces on images go to sources elsewhere: the tangent of a part would lack them.
  return std::make_unique<Damaged>(*this, std::move(points), images() != nullptr);
}

}  // namespace perikit
