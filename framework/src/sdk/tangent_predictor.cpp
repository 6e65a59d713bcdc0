#include "perikit/sdk/tangent_predictor.hpp"

#include "perikit/core/field_operations.hpp"

namespace perikit {

bool predict_by_tangent(Equilibrium& equilibrium, bool extrapolated, const PreconditionerAction& precondition) {
  if (extrapolated) {
    equilibrium.impose(equilibrium.displacement());
    return true;
  }
  constexpr int most = 300;
  constexpr double accuracy = 1e-2;
  Problem& problem = equilibrium.problem();
  const auto make = [&] { return problem.make_field(); };
  const FieldView u = equilibrium.displacement();
  Field start = make(), r = make(), w = make(), Kw = make(), du = make();
  copy(u, start);
  if (!equilibrium.residual(start, r)) return false;
  if (equilibrium.missing(start, w) > 0) {
    if (!equilibrium.tangent(start, w, Kw)) return false;
    combine(1, r, -1, Kw, r);
  }
  equilibrium.impose(u);
  Field z = precondition ? make() : Field{};
  const double enough = accuracy * norm(r);
  double last = 0;
  for (int k = 0; k < most && norm(r) > enough; ++k) {
    if (precondition) precondition(r, z);
    const ConstFieldView step = precondition ? z : r;
    const double product = dot(r, step);
    if (!(product > 0)) break;
    combine(1, step, k > 0 ? product / last : 0.0, w, w);
    last = product;
    if (!equilibrium.tangent(start, w, Kw)) return false;
    const double curvature = dot(w, Kw);
    if (!(curvature > 0)) break;
    combine(1, du, product / curvature, w, du);
    combine(1, r, -product / curvature, Kw, r);
  }
  combine(1, u, 1, du, u);
  return true;
}

}  // namespace perikit
