#pragma once
/// Conjugate gradients for the systems that balance a constant stress on a cloud. A system has
///   make()              a vector of its unknowns
///   apply(x, y)         y <- A x
///   precondition(r, z)  z <- P r
///   largest(r)          the largest |A_k| in a residual, over volume and spacing

#include <algorithm>

#include "perikit/core/field_operations.hpp"

namespace perikit {

/// Residuals below this are rounding.
inline constexpr double rounding_residual = 2e-13;
/// Residuals below this change the stiffness of a body by less than 0.1 %.
inline constexpr double enough_residual = 5e-3;

/// How long a balance is sought for: until its residual is rounding, but no longer than `polish` iterations once it is enough,
/// and never longer than `most`: clouds that cannot be balanced would go on for ever.
struct BalanceEffort {
  int polish, most;
  bool ends(double residual, int iterations) const noexcept {
    return residual <= rounding_residual || iterations >= (residual <= enough_residual ? polish : most);
  }
};

/// What conjugate gradients came to.
struct Solved {
  Field x;
  int iterations = 0;
  bool contradiction = false;   ///< no x solves the system: x is nothing
};

/// Of squared residuals in the norm of the preconditioner. They fall, or rise by a little, where a system has a solution, and grow
/// without bound where it has none.
inline constexpr double contradictory_growth = 1e4;

/// x with A x = b, from x = 0, to a residual of `wanted`. Ends where the residual no longer falls, too.
template <class System>
Solved solve(System& system, const Field& b, double wanted, const BalanceEffort& effort) {
  Solved solved{system.make()};
  auto& [x, iterations, contradiction] = solved;
  Field r = b, direction = system.make(), image = system.make();
  double best = 0;
  for (int restart = 0; restart < 4; ++restart) {
    if (restart > 0) {
      system.apply(x, r);
      combine(1, b, -1, r, r);
    }
    double residual = system.largest(r);
    if (residual <= wanted || (restart > 0 && residual > 0.5 * best)) break;
    best = residual;
    system.precondition(r, direction);
    double product = dot(r, direction);
    const double start = product;
    int since = 0;
    for (double least = product; !effort.ends(residual, iterations) && product > 0; ++iterations) {
      system.apply(direction, image);
      const double curvature = dot(direction, image);
      if (!(curvature > 0)) break;
      const double step = product / curvature;
      combine(1, x, step, direction, x);
      combine(1, r, -step, image, r);
      residual = system.largest(r);
      if (residual <= 0.5 * wanted) break;
      Field& z = image;  // which has had its use
      system.precondition(r, z);
      const double next = dot(r, z);
      since = next < 0.5 * least ? 0 : since + 1;
      least = std::min(least, next);
      contradiction = next > contradictory_growth * start;
      if (contradiction) return solved;
      if (since > 1000 || next < 1e-30 * start) break;
      combine(1, z, next / product, direction, direction);
      product = next;
    }
  }
  return solved;
}

}  // namespace perikit
