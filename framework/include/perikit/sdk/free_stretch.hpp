#pragma once
/// Plane and uniaxial stress: the stretch normal to the body is not given but follows from zero stress normal to it.

#include <limits>

#include "perikit/sdk/differentiation.hpp"

namespace perikit {

/// The direction that is free: zz of a plane, yy + zz of a line (equal for an isotropic law).
template <class T, class S>
Tensor<T, S> free_direction() noexcept {
  return Tensor<T, S>::build([](int i, int j) { return T(i == j && i >= S::dimension ? 1.0 : 0.0); });
}

template <class T, class S, class U>
Tensor<T, S> with_free_part(Tensor<T, S> a, const U& s) noexcept {
  for (int i = S::dimension; i < 3; ++i) a(i, i) = s;
  return a;
}

/// Lateral contraction at F = I in the sense of logarithmic strains, -d ln(free stretch) / d ln(J in the body's space).
template <class S, class Law, class K>
Pack contraction_ratio(const Law& law, const K& k) noexcept {
  const auto q = tangent(law, Tensor<Pack, S>::map([](int) { return Pack(0.0); }), k)(free_direction<Pack, S>());
  return q[0] / inner(free_direction<Pack, S>(), q);
}

/// H with its free components such that the free stress vanishes to rounding. Lanes that are not `good` on entry keep H = 0;
/// lanes without a solution are taken from `good`. Newton in the logarithm of the stretch, where rubber laws are nearly linear,
/// started from the exact solution for a Kirchhoff stress linear in the logarithmic strain, kept inside a bracket; each lane
/// stops on its own.
template <bool small_strain, class Law, class S, class K>
Tensor<Pack, S> solve_free_stretch(const Law& law, Tensor<Pack, S> H, const K& k, Pack ratio, PackMask& good) noexcept {
  constexpr int max_iterations = 80;
  constexpr double infinity = std::numeric_limits<double>::infinity();
  const Tensor<Pack, S> N = free_direction<Pack, S>();
  H = with_free_part(H, Pack(0.0));
  Pack size = 0.0;
  for (int c = 0; c < S::components; ++c) size = max(size, abs(H[c]));
  const Pack j = jacobian_minus_one(H);
  if constexpr (!small_strain) good &= (j > -1.0) & (j < infinity);
  good &= size < infinity;
  H = Tensor<Pack, S>::map([&](int c) { return select(good, H[c], Pack(0.0)); });

  Pack y = small_strain ? Pack(0.0) : -ratio * log1p(select(good, j, Pack(0.0)));
  Pack h = small_strain ? Pack(0.0) : expm1(y);
  Pack lower = -infinity, upper = infinity;
  PackMask active = good;
  for (int iteration = 0; iteration < max_iterations && any(active); ++iteration) {
    H = with_free_part(H, h);
    const Pack residual = inner(N, stress(law, H, k));
    const Pack stiffness = inner(N, tangent(law, H, k)(N));
    Pack step, next;
    if constexpr (small_strain) {
      step = -residual / stiffness;
      next = h + step;
    } else {
      const Pack x = 1.0 + h, slope = residual + x * stiffness;  // d(x residual)/dy over x
      const PackMask low = residual<0.0, high = residual> 0.0;
      lower = select(low & active, y, lower);
      upper = select(high & active, y, upper);
      const Pack newton = min(max(-residual / slope, Pack(-1.0)), Pack(1.0));
      step = select(slope > 0.0, newton, select(low, Pack(1.0), Pack(-1.0)));
      step = select(low & (y + step > upper), 0.5 * (upper - y), step);
      step = select(high & (y + step < lower), 0.5 * (lower - y), step);
      step = select(residual == 0.0, Pack(0.0), step);
      next = h + x * expm1(step);
      y = select(active, y + step, y);
    }
    h = select(active, next, h);
    active &= abs(step) > 1e-8 * size;  // convergence is quadratic: the step just taken is the last that matters
  }
  good &= !active;
  return with_free_part(H, select(good, h, Pack(0.0)));
}

/// dH -> dP under zero free stress: dP = A : (dH + N dh) with N : dP = 0.
template <class Law, class S, class K>
auto condensed_tangent(const Law& law, const Tensor<Pack, S>& H, const K& k) noexcept {
  auto full = tangent(law, H, k);
  const Tensor<Pack, S> N = free_direction<Pack, S>(), q = full(N);
  return [full, N, q, inverse = 1.0 / inner(N, q)](const Tensor<Pack, S>& dH) {
    const Tensor<Pack, S> dP = full(with_free_part(dH, Pack(0.0)));
    return with_free_part(dP - (inner(N, dP) * inverse) * q, Pack(0.0));
  };
}

}  // namespace perikit
