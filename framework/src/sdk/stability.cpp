#include "perikit/sdk/stability.hpp"

#include <cmath>

#include "perikit/core/field_operations.hpp"

namespace perikit {

bool has_negative_curvature(Equilibrium& equilibrium, ConstFieldView u, const PreconditionerAction& precondition, int most) {
  constexpr double rounding = 1e-13;  // of the stiffness against noise: curvatures below it, as of pieces that nothing holds, are none
  Problem& problem = equilibrium.problem();
  // E = u . K u/2 with sums of squares for K and a constant load: no equilibrium of it is unstable.
  if (problem.constant_stiffness() && !problem.loads().follow()) return false;
  Field r = problem.make_field(), w = problem.make_field(), Kw = problem.make_field(), z = precondition ? problem.make_field() : Field{};
  fill_with_noise(equilibrium.free(), 2, problem.body().places(), r);
  const double size = norm(r);
  if (!(size > 0) || !equilibrium.tangent(u, r, Kw)) return false;
  const double stiffness = norm(Kw) / size;
  // A motion has a share of n^-1/2 in noise of n numbers: a tenth of that is left once all have been met.
  const double enough = 0.1 * size / std::sqrt(dot(equilibrium.free(), equilibrium.free()));
  double last = 0;
  for (int k = 0; k < most && norm(r) > enough; ++k) {
    if (precondition) precondition(r, z);
    const ConstFieldView step = precondition ? z : r;
    const double product = dot(r, step);
    if (!(product > 0)) return false;
    combine(1, step, k > 0 ? product / last : 0.0, w, w);
    last = product;
    if (!equilibrium.tangent(u, w, Kw)) return false;
    const double curvature = dot(w, Kw), least = rounding * stiffness * dot(w, w);
    if (curvature < -least) return true;
    if (!(curvature > least)) return false;
    combine(1, r, -product / curvature, Kw, r);
  }
  return false;
}

}  // namespace perikit
