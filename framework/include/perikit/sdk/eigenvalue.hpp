#pragma once
/// Largest eigenvalues of tangents.

#include <functional>

#include "perikit/problem/problem.hpp"

namespace perikit {

/// Where a largest eigenvalue lies: the largest Ritz value, which is nearly it once the iteration has converged, and that plus its residual bound.
struct EigenvalueBounds {
  double ritz = 0, bound = 0;
  bool given_up = false;
};

/// Asked before each tangent action; false gives the estimate up. Large bodies take seconds for an estimate, and a run ends within one of its signal.
using GoesOn = std::function<bool()>;

/// The largest eigenvalue of S K S at u by Lanczos iteration on the exact tangent, to about 2 %. scale: the diagonal of S, 0 on components that do not
/// move (mask/sqrt(mass) for vibrations, the mask itself for statics). vector: start on entry where `warm`, rich in the top of the spectrum on return.
/// From a warm start the iteration ends early, mostly after four tangent actions, where the bound lies below `enough` and is known to 10 %.
/// 0 where nothing moves, u is inadmissible or the estimate was given up, which leaves `vector` as it was.
EigenvalueBounds eigenvalue_bounds(Problem& problem, ConstFieldView u, ConstFieldView scale, FieldView vector, bool warm, double enough = 0,
                                   const GoesOn& goes_on = {});
/// Its bound.
double largest_eigenvalue(Problem& problem, ConstFieldView u, ConstFieldView scale, FieldView vector, bool warm, const GoesOn& goes_on = {});
/// That of the rows and columns of a part of the body, from noise: not above that of the body. Once it is known to lie below `enough`, a bound
/// below `enough` is returned, mostly after three tangent actions.
double largest_eigenvalue(Problem& problem, DamagedPart& part, ConstFieldView u, ConstFieldView scale, double enough = 0);

}  // namespace perikit
