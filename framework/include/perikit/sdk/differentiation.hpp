#pragma once
/// The pieces of a point law that its author did not write, by forward differentiation of those that are there.
///
/// A law has psi(H, k), P(H, k) or both, generic over the scalar, and may have tangent(H, k), which returns dH -> A : dH.
/// H: Tensor<T, S>; k: std::array of the law's constants.
///
/// Where these begin with the same invariants a law may state them once: invariants(H) returns them, with det F - 1 as a member j, and
/// psi, P and tangent take them as a third argument. They are found for several points before the stress of the first is due.

#include "perikit/core/tensor.hpp"

namespace perikit {

template <class Law, class T, class S>
concept HasInvariants = requires(const Law& law, const Tensor<T, S>& H) {
  { law.invariants(H).j } -> std::convertible_to<T>;
};
template <class Law, class T, class S, class K>
concept HasEnergy = requires(const Law& law, const Tensor<T, S>& H, const K& k) {
  { law.psi(H, k) } -> std::same_as<T>;
} || requires(const Law& law, const Tensor<T, S>& H, const K& k) {
  { law.psi(H, k, law.invariants(H)) } -> std::same_as<T>;
};
template <class Law, class T, class S, class K>
concept HasStress = requires(const Law& law, const Tensor<T, S>& H, const K& k) {
  { law.P(H, k) } -> std::same_as<Tensor<T, S>>;
} || requires(const Law& law, const Tensor<T, S>& H, const K& k) {
  { law.P(H, k, law.invariants(H)) } -> std::same_as<Tensor<T, S>>;
};
template <class Law, class T, class S, class K>
concept HasTangent = requires(const Law& law, const Tensor<T, S>& H, const K& k) {
  law.tangent(H, k)(H);
} || requires(const Law& law, const Tensor<T, S>& H, const K& k) {
  law.tangent(H, k, law.invariants(H))(H);
};

/// H + epsilon dH.
template <class T, class S>
Tensor<Dual<T>, S> along(const Tensor<T, S>& H, const Tensor<T, S>& dH) noexcept {
  return Tensor<Dual<T>, S>::map([&](int c) { return Dual<T>{H[c], dH[c]}; });
}

struct NoInvariants {};

template <class Law, class T, class S>
auto invariants(const Law& law, const Tensor<T, S>& H) noexcept {
  if constexpr (HasInvariants<Law, T, S>)
    return law.invariants(H);
  else
    return NoInvariants();
}

/// of: invariants(law, H).
template <class Law, class T, class S, class K, class Invariants>
T energy(const Law& law, const Tensor<T, S>& H, const K& k, const Invariants& of) noexcept {
  if constexpr (HasInvariants<Law, T, S>)
    return law.psi(H, k, of);
  else
    return law.psi(H, k);
}
template <class Law, class T, class S, class K>
T energy(const Law& law, const Tensor<T, S>& H, const K& k) noexcept {
  return energy(law, H, k, invariants(law, H));
}

/// dpsi/dF, one component at a time.
template <class Law, class T, class S, class K>
Tensor<T, S> stress_from_energy(const Law& law, const Tensor<T, S>& H, const K& k) noexcept {
  Tensor<T, S> P;
  // kept rolled: the body is a whole energy
#pragma GCC unroll 1
  for (int c = 0; c < S::components; ++c) P[c] = energy(law, along(H, Tensor<T, S>::unit(c)), k).derivative;
  return P;
}

/// of: invariants(law, H).
template <class Law, class T, class S, class K, class Invariants>
Tensor<T, S> stress(const Law& law, const Tensor<T, S>& H, const K& k, const Invariants& of) noexcept {
  if constexpr (!HasStress<Law, T, S, K>)
    return stress_from_energy(law, H, k);
  else if constexpr (HasInvariants<Law, T, S>)
    return law.P(H, k, of);
  else
    return law.P(H, k);
}
template <class Law, class T, class S, class K>
Tensor<T, S> stress(const Law& law, const Tensor<T, S>& H, const K& k) noexcept {
  return stress(law, H, k, invariants(law, H));
}

/// dH -> A : dH at H. of: invariants(law, H).
template <class Law, class T, class S, class K, class Invariants>
auto tangent(const Law& law, const Tensor<T, S>& H, const K& k, [[maybe_unused]] const Invariants& of) noexcept {
  if constexpr (HasTangent<Law, T, S, K> && HasInvariants<Law, T, S>) {
    return law.tangent(H, k, of);
  } else if constexpr (HasTangent<Law, T, S, K>) {
    return law.tangent(H, k);
  } else {
    return [&law, H, k](const Tensor<T, S>& dH) {
      const Tensor<Dual<T>, S> P = stress(law, along(H, dH), k);
      return Tensor<T, S>::map([&](int c) { return P[c].derivative; });
    };
  }
}

template <class Law, class T, class S, class K>
auto tangent(const Law& law, const Tensor<T, S>& H, const K& k) noexcept {
  return tangent(law, H, k, invariants(law, H));
}

}  // namespace perikit
