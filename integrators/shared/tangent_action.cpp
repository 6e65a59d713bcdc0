#include "tangent_action.hpp"

#include <cmath>
#include <limits>

#include "perikit/core/field_operations.hpp"

namespace perikit {

TangentAction::TangentAction(Problem& problem, bool differences)
    : problem_(problem), differences_(differences), u_(problem.make_field()) {
  if (!differences) return;
  moved_ = problem.make_field();
  force_ = problem.make_field();
}

void TangentAction::move_to(ConstFieldView u) {
  copy(u, u_);
}

bool TangentAction::apply(Equilibrium& equilibrium, ConstFieldView w, FieldView Kw, std::string& failure) {
  if (differences_) return difference(equilibrium, w, Kw, failure);
  if (equilibrium.tangent(u_, w, Kw)) return true;
  failure = equilibrium.failure();
  return false;
}

bool TangentAction::difference(Equilibrium& equilibrium, ConstFieldView w, FieldView Kw, std::string& failure) {
  // P 3.73-3.74: K w = -(f(u + eps w) - f(u - eps w))/(2 eps); eps w moves points by the cube root of the rounding unit times the
  // spacing.
  const double largest = largest_magnitude(w);
  if (largest < std::numeric_limits<double>::min()) {   // the step would be infinite
    fill(0.0, Kw);
    return true;
  }
  const double eps = std::cbrt(std::numeric_limits<double>::epsilon()) * problem_.points().spacing() / largest;
  for (const double sign : {1.0, -1.0}) {
    combine(1, u_, sign * eps, w, moved_);
    const EvaluationStatus status = problem_.evaluate_forces(equilibrium.at(moved_), sign > 0 ? Kw : FieldView(force_), nullptr);
    if (!status.ok()) {
      failure = status.description;
      return false;
    }
  }
  combine(0.5 / eps, force_, -0.5 / eps, Kw, Kw);
  mask(equilibrium.free(), Kw);
  return true;
}

}  // namespace perikit
