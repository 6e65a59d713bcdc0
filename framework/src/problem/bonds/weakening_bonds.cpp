#include "perikit/problem/weakening_bonds.hpp"

#include "perikit/core/field_operations.hpp"
#include "problem/body_problem.hpp"

namespace perikit {

class BodyProblem::Weakening final : public WeakeningBonds {
 public:
  explicit Weakening(BodyProblem& problem) : problem_(problem), direction_(problem.make_field()), change_(problem.make_field()) {
    problem_.fracture()->let_others_forecast(true);
  }
  ~Weakening() override { problem_.fracture()->let_others_forecast(false); }

  bool any() const override { return problem_.fracture()->settling(); }

  EvaluationStatus add_tangent(const Configuration& at, ConstFieldView w, FieldView Kw) override {
    fill(0.0, change_);
    EvaluationStatus status;
    if (!problem_.fracture()->add_weakening(at.moved_to(problem_.seen(at.u(), problem_.seen_)), problem_.seen(w, direction_), change_))
      status.description = "near bonds that weaken";
    problem_.describe(status);
    problem_.finish(change_, status);
    if (status.ok()) combine(1, Kw, -1, change_, Kw);
    return status;
  }

  bool weaken(const Configuration& at, ConstFieldView du) override {
    combine(1, at.u(), 1, du, change_);
    const BondUpdate update =
        problem_.fracture()->weaken(at.moved_to(problem_.seen(at.u(), problem_.seen_)), problem_.seen(change_, direction_));
    problem_.dissipate(update.dissipated);
    if (update.changed > 0) problem_.find_pieces(true);   // fragments may have come off
    return update.changed > 0;
  }

 private:
  BodyProblem& problem_;
  Field direction_, change_;
};

std::unique_ptr<WeakeningBonds> BodyProblem::weakening_bonds() {
  if (parts_.partition || !parts_.fracture || parts_.fracture->damage().law->traits().bits) return nullptr;
  return std::make_unique<Weakening>(*this);
}

}  // namespace perikit
