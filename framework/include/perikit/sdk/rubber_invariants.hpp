#pragma once
/// Invariants of rubber-like laws, whose energies depend on the isochoric part of the deformation and on its volume.

#include "perikit/core/simd.hpp"
#include "perikit/core/tensor.hpp"

namespace perikit {

/// What stresses and energies of such a law begin with.
template <class T>
struct RubberInvariants {
  T j;       ///< J - 1
  T m;       ///< tr(C)/3 - 1
  T root;    ///< J^(-1/3)
  T square;  ///< H : H
  T shape;   ///< 3 m - 2 j, without the terms of first order that cancel

  template <class S>
  explicit RubberInvariants(const Tensor<T, S>& H) noexcept : square(inner(H, H)) {
    const T sum = trace(H), beyond = jacobian_beyond_trace(H);
    j = sum + beyond;
    m = (2.0 * sum + square) * (1.0 / 3.0);
    shape = square - 2.0 * beyond;
    root = reciprocal_cbrt(T(1.0 + j));
  }
  RubberInvariants() = default;
};

/// (1 + m)^3 - J^2, m = tr(C)/3 - 1, from the deviator d of C - I: det C = (1 + m)^3 + (1 + m) I2(d) + det(d) = J^2. Apart and by value, as it is
/// seldom needed.
template <class T, class S>
[[gnu::noinline, gnu::cold]] T cubes_of_deviator(Tensor<T, S> H, T m) noexcept {
  const Tensor<T, S> d = deviator(right_cauchy_green_minus_identity(H));
  return -(second_invariant(d) * (1.0 + m) + determinant(d));
}

/// J^(-2/3) I1(C) - 3 = 3 t, 1 + t = s = (1 + m) J^(-2/3), with the digits of small strains: s^3 - 1 = ((1 + m)^3 - J^2)/J^2 = e. In the numerator
/// cancels what a rotation adds to H; where that takes more than six digits the deviator keeps them. Of a small t that is s - 1 rounding leaves
/// nothing; a step of Newton gives it the digits of e,
///   t - (t (3 + t (3 + t)) - e)/(3 (1 + t)^2),
/// where (1 - t)/3 will do for the last factor: it differs by no more than t, and vanishes at t = 1, from where on s - 1 has all digits.
template <class T, class S>
T first_isochoric_strain(const Tensor<T, S>& H, const RubberInvariants<T>& of) noexcept {
  const T &j = of.j, &m = of.m, scale = of.root * of.root, inverse_J = of.root * scale;
  T cubes = of.shape + ((m * m) * (3.0 + m) - j * j);
  if (const auto turned = cubes - 1e-6 * of.square < 0.0; any(turned)) [[unlikely]]
    cubes = select(turned, cubes_of_deviator(H, m), cubes);
  const T t = scale * m + (scale - 1.0), near = select(t < 1.0, t, T(1.0));
  const T beyond = near * (3.0 + near * (3.0 + near)) - cubes * (inverse_J * inverse_J);
  return 3.0 * t + (near - 1.0) * beyond;
}

/// J^(-4/3) I2(C) - 3 = 3 s^2 - 3 + J^(-4/3) I2(d), d the deviator of C - I or b - I. first: the one before.
template <class T, class S>
T second_isochoric_strain(const Tensor<T, S>& d, const RubberInvariants<T>& of, const T& first) noexcept {
  const T scale = of.root * of.root;
  return second_invariant(d) * (scale * scale) + first * (1.0 + scale * (1.0 + of.m));
}

}  // namespace perikit
