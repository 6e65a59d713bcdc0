#pragma once
/// The pieces of a point law that its author did not write, by forward differentiation of those that are there.
///
/// A law has psi(H, k), P(H, k) or both, generic over the scalar, and may have tangent(H, k), which returns dH -> A : dH.
/// H: Tensor<T, S>; k: std::array of the law's constants.

#include "perikit/core/tensor.hpp"

namespace perikit {

template <class Law, class T, class S, class K>
concept HasEnergy = requires(const Law& law, const Tensor<T, S>& H, const K& k) {
  { law.psi(H, k) } -> std::same_as<T>;
};
template <class Law, class T, class S, class K>
concept HasStress = requires(const Law& law, const Tensor<T, S>& H, const K& k) {
  { law.P(H, k) } -> std::same_as<Tensor<T, S>>;
};
template <class Law, class T, class S, class K>
concept HasTangent = requires(const Law& law, const Tensor<T, S>& H, const K& k) {
  law.tangent(H, k)(H);
};

/// H + epsilon dH.
template <class T, class S>
Tensor<Dual<T>, S> along(const Tensor<T, S>& H, const Tensor<T, S>& dH) noexcept {
  return Tensor<Dual<T>, S>::map([&](int c) { return Dual<T>{H[c], dH[c]}; });
}

/// dpsi/dF, one component at a time.
template <class Law, class T, class S, class K>
Tensor<T, S> stress_from_energy(const Law& law, const Tensor<T, S>& H, const K& k) noexcept {
  Tensor<T, S> P;
  // kept rolled: the body is a whole energy
#pragma GCC unroll 1
  for (int c = 0; c < S::components; ++c) P[c] = law.psi(along(H, Tensor<T, S>::unit(c)), k).derivative;
  return P;
}

template <class Law, class T, class S, class K>
Tensor<T, S> stress(const Law& law, const Tensor<T, S>& H, const K& k) noexcept {
  if constexpr (HasStress<Law, T, S, K>)
    return law.P(H, k);
  else
    return stress_from_energy(law, H, k);
}

/// dH -> A : dH at H.
template <class Law, class T, class S, class K>
auto tangent(const Law& law, const Tensor<T, S>& H, const K& k) noexcept {
  if constexpr (HasTangent<Law, T, S, K>) {
    return law.tangent(H, k);
  } else {
    return [&law, H, k](const Tensor<T, S>& dH) {
      const Tensor<Dual<T>, S> P = stress(law, along(H, dH), k);
      return Tensor<T, S>::map([&](int c) { return P[c].derivative; });
    };
  }
}

}  // namespace perikit
