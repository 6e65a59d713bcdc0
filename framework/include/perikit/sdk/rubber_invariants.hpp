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
  T first;   ///< J^(-2/3) I1 - 3
  T second;  ///< J^(-4/3) I2 - 3
};

/// Of e = C - I or b - I, term by term of second order in its deviator d, so that they keep their digits where d is small. With
/// s = (1 + m) J^(-2/3), p = I2(d) J^(-4/3), q = det(d) J^-2: J^(-2/3) I1 = 3 s and J^(-4/3) I2 = 3 s^2 + p, and det C = J^2 says that
/// s^3 = 1 - p s - q.
template <class T, class S>
IsochoricStrains<T> isochoric_strains(const Tensor<T, S>& e, const RubberInvariants<T>& of) noexcept {
  const T scale = of.root * of.root, s = scale * (1.0 + of.m);
  const Tensor<T, S> d = deviator(e);
  const T p = second_invariant(d) * (scale * scale), q = determinant(d) * (scale * scale * scale), inverse = 1.0 / (1.0 + s * (1.0 + s));
  return {-3.0 * (p * s + q) * inverse, (p * (1.0 - 2.0 * s * (1.0 + s)) - 3.0 * q * (1.0 + s)) * inverse};
}

}  // namespace perikit
