#pragma once
/// Invariants of rubber-like laws, whose energies depend on the isochoric part of the deformation and on its volume.

#include "perikit/core/simd.hpp"
#include "perikit/core/tensor.hpp"

namespace perikit {

/// What stresses and energies of such a law begin with.
template <class T>
struct RubberInvariants {
  T j;     ///< J - 1
  T m;     ///< tr(C)/3 - 1
  T root;  ///< J^(-1/3)

  template <class S>
  explicit RubberInvariants(const Tensor<T, S>& H) noexcept
      : j(jacobian_minus_one(H)), m((2.0 * trace(H) + inner(H, H)) * (1.0 / 3.0)), root(reciprocal_cbrt(T(1.0 + j))) {}
  RubberInvariants() = default;
};

template <class T>
struct IsochoricStrains {
  T first;   ///< J^(-2/3) I1(C) - 3
  T second;  ///< J^(-4/3) I2(C) - 3
};

/// Of e = C - I or b - I, term by term of second order in its deviator d, so that they keep their digits where d is small. With
/// s = (1 + m) J^(-2/3) they are 3 s - 3 and 3 s^2 + I2(d) J^(-4/3) - 3, and det C = (1 + m)^3 + (1 + m) I2(d) + det(d) = J^2 says that
/// s^3 - 1 = -((1 + m) I2(d) + det(d))/J^2.
template <class T, class S>
IsochoricStrains<T> isochoric_strains(const Tensor<T, S>& e, const RubberInvariants<T>& of) noexcept {
  const T scale = of.root * of.root, inverse_J = of.root * scale, s = scale * (1.0 + of.m);
  const Tensor<T, S> d = deviator(e);
  const T I2 = second_invariant(d), cubes = (I2 * (1.0 + of.m) + determinant(d)) * (inverse_J * inverse_J);
  const T first = -3.0 * cubes * reciprocal(T(1.0 + s * (1.0 + s)));
  return {first, I2 * (scale * scale) + first * (1.0 + s)};
}

}  // namespace perikit
