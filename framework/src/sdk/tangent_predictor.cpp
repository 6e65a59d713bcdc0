#include "perikit/sdk/tangent_predictor.hpp"

#include "perikit/core/field_operations.hpp"

namespace perikit {

bool predict_by_tangent(Equilibrium& equilibrium, bool extrapolated) {
  if (extrapolated) {
    equilibrium.impose(equilibrium.displacement());
    return true;
  }
  constexpr int most = 300;
  constexpr double accuracy = 1e-2;
  Problem& problem = equilibrium.problem();
  const auto make = [&] { return problem.make_field(problem.dimension()); };
  const FieldView u = equilibrium.displacement();
  Field start = make(), r = make(), w = make(), Kw = make(), du = make();
  copy(u, start);
  if (!equilibrium.residual(start, r)) return false;
  if (equilibrium.missing(start, w) > 0) {
    if (!equilibrium.tangent(start, w, Kw)) return false;
    combine(1, r, -1, Kw, r);
  }
  equilibrium.impose(u);
  double squares = dot(r, r);
  const double enough = accuracy * accuracy * squares;
  copy(r, w);
  for (int k = 0; k < most && squares > enough; ++k) {
    if (!equilibrium.tangent(start, w, Kw)) return false;
    const double curvature = dot(w, Kw);
    if (!(curvature > 0)) break;
    const double alpha = squares / curvature;
    combine(1, du, alpha, w, du);
    combine(1, r, -alpha, Kw, r);
    const double next = dot(r, r);
    combine(1, r, next / squares, w, w);
    squares = next;
  }
  combine(1, u, 1, du, u);
  return true;
}

}  // namespace perikit
