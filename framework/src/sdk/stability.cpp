#include "perikit/sdk/stability.hpp"

#include <cmath>

#include "perikit/core/field_operations.hpp"

namespace perikit {

Curvature curvature_of(Problem& problem, ConstFieldView free, const StiffnessAction& K, const PreconditionerAction& precondition, int most) {
  constexpr double rounding = 1e-13;  // of the stiffness against noise: curvatures below it, as of pieces that nothing holds, are none
  Field r = problem.make_field(), w = problem.make_field(), Kw = problem.make_field(), z = precondition ? problem.make_field() : Field{};
  fill_with_noise(free, 2, problem.points().places(), r);
  const double size = norm(r);
  if (!(size > 0) || !K(r, Kw)) return Curvature::unknown;
  const double stiffness = norm(Kw) / size;
  // A motion has a share of n^-1/2 in noise of n numbers: a tenth of that is left once all have been met.
  const double enough = 0.1 * size / std::sqrt(dot(free, free));
  double last = 0;
  for (int k = 0; norm(r) > enough; ++k) {
    if (k == most) return Curvature::unknown;
    if (precondition) precondition(r, z);
    const ConstFieldView step = precondition ? z : r;
    const double product = dot(r, step);
    if (!(product > 0)) return Curvature::unknown;
    combine(1, step, k > 0 ? product / last : 0.0, w, w);
    last = product;
    if (!K(w, Kw)) return Curvature::unknown;
    const double curvature = dot(w, Kw), least = rounding * stiffness * dot(w, w);
    if (curvature < -least) return Curvature::negative;
    if (!(curvature > least)) return Curvature::unknown;
    combine(1, r, -product / curvature, Kw, r);
  }
  return Curvature::positive;
}

bool has_negative_curvature(Equilibrium& equilibrium, ConstFieldView u, const PreconditionerAction& precondition, int most) {
  Problem& problem = equilibrium.problem();
  // E = u . K u/2 with sums of squares for K and a constant load: no equilibrium of it is unstable.
  if (problem.constant_stiffness() && !problem.loads().follow()) return false;
  const auto tangent = [&](ConstFieldView w, FieldView Kw) { return equilibrium.tangent(u, w, Kw); };
  return curvature_of(problem, equilibrium.free(), tangent, precondition, most) == Curvature::negative;
}

}  // namespace perikit
