#pragma once
/// What is wrong with a law, in one line each: LawMaterial asks for this before anything else of the law is compiled.

#include <array>
#include <concepts>
#include <cstddef>
#include <type_traits>

#include "perikit/model/material.hpp"
#include "perikit/sdk/differentiation.hpp"
#include "perikit/sdk/history.hpp"

namespace perikit {

/// Variables that a law reads from outside, and numbers that its functions find in k.
template <class Law>
inline constexpr std::size_t external_size = [] {
  if constexpr (requires { Law::external.size(); }) return Law::external.size();
  else return std::size_t{0};
}();
template <class Law>
inline constexpr std::size_t constants_of = static_cast<std::size_t>(Law::traits.constants) + external_size<Law>;

}  // namespace perikit

namespace perikit::detail {

// Whether a class has a member of this name, whatever its arguments: beside another base with one the name would say nothing.
struct NamedPsi {
  int psi;
};
struct NamedP {
  int P;
};
template <class Law, class Name>
struct Beside : Law, Name {};
template <class Law>
consteval bool names_psi() {
  if constexpr (std::is_final_v<Law>) return false;   // no base of anything: not known
  else return !requires { &Beside<Law, NamedPsi>::psi; };
}
template <class Law>
consteval bool names_P() {
  if constexpr (std::is_final_v<Law>) return false;
  else return !requires { &Beside<Law, NamedP>::P; };
}

template <class Law>
concept HasTraits = requires {
  { Law::traits } -> std::convertible_to<MaterialTraits>;
  typename std::integral_constant<int, Law::traits.constants>;
};

/// A law without history: psi or P of packs, and of what they are differentiated with.
template <class Law, class K>
consteval void check_energy_and_stress() {
  using T = Pack;
  using H = Tensor<T, Solid>;
  constexpr bool energy = HasEnergy<Law, T, Solid, K>, stress = HasStress<Law, T, Solid, K>;
  if constexpr (!energy && names_psi<Law>()) {
    static_assert(!requires(Law& law, const H& h, const K& k) { { law.psi(h, k) } -> std::same_as<T>; } || energy,
                  "psi must not change the law: write const behind it, template <class T, class S, class K> T psi(const Tensor<T, S>& H, const K& k) const noexcept");
    static_assert(!requires(const Law& law, const H& h, const K& k) { law.psi(h, k); } || energy,
                  "psi returns another type than T: write template <class T, class S, class K> T psi(const Tensor<T, S>& H, const K& k) const noexcept");
    static_assert(energy || requires(Law& law, const H& h, const K& k) { law.psi(h, k); },
                  "psi does not take every scalar T and space S: write template <class T, class S, class K> T psi(const Tensor<T, S>& H, const K& k) const noexcept");
  } else if constexpr (!stress && names_P<Law>()) {
    static_assert(stress, "P is not as it must be: write template <class T, class S, class K> Tensor<T, S> P(const Tensor<T, S>& H, const K& k) const noexcept");
  } else {
    static_assert(energy || stress, "a law needs an energy: template <class T, class S, class K> T psi(const Tensor<T, S>& H, const K& k) const noexcept");
    static_assert(energy || !stress || !Law::traits.hyperelastic,
                  "a law with P alone stores no energy: add T psi(const Tensor<T, S>& H, const K& k), or declare .hyperelastic = false in its traits");
    if constexpr (energy && !stress)
      static_assert(HasEnergy<Law, Dual<T>, Solid, K>,
                    "psi takes packs alone, and the stress is its derivative: write it for every scalar T, "
                    "template <class T, class S, class K> T psi(const Tensor<T, S>& H, const K& k) const noexcept");
    else if constexpr (stress && !HasTangent<Law, T, Solid, K>)
      static_assert(HasStress<Law, Dual<T>, Solid, K>,
                    "P takes packs alone, and the tangent is its derivative: write it for every scalar T, "
                    "template <class T, class S, class K> Tensor<T, S> P(const Tensor<T, S>& H, const K& k) const noexcept");
  }
}

/// A law with history: the law of a step.
template <class Law>
consteval void check_steps() {
  using State = std::array<Pack, components_of(Law::template state<Solid>)>;
  static_assert(HasTimeStep<Law> || requires(const Law& law, const State& state) { law.template after<Solid>(state); },
                "a law with history needs template <class S, class T> auto after(const std::array<T, components_of(state<S>)>& begin) const noexcept, "
                "the law of the step that begins at this state (perikit/sdk/history.hpp)");
}

template <class Law>
consteval bool check_law() {
  static_assert(HasTraits<Law>, "a law needs its traits: static constexpr MaterialTraits traits{.constants = 2}, with the number of constants that psi and P read");
  if constexpr (HasTraits<Law>) {
    static_assert(requires(const Law& law, const MaterialInput& input, double* k) { law.constants(input, k); },
                  "a law needs `void constants(const MaterialInput& input, double* k) const`, which writes what psi and P read");
    static_assert(requires(const Law& law, const double* k) { { law.small_strain(k) } -> std::convertible_to<Moduli>; },
                  "a law needs `Moduli small_strain(const double* k) const noexcept`, its Lame constants at rest");
    static_assert(HasHistory<Law> || !requires { Law::template state_components<Solid>; },
                  "a law with history names what it remembers: "
                  "template <class S> static constexpr std::array state{StateVariable{\"stress\", \"Pa\", symmetric_size<S>}}");
    static_assert(HasHistory<Law> || !Law::traits.limits_step, "a law without history takes no steps: leave out limits_step, or name what it remembers (perikit/sdk/history.hpp)");
    if constexpr (HasHistory<Law>) check_steps<Law>();
    else check_energy_and_stress<Law, std::array<Pack, constants_of<Law>>>();
  }
  return true;
}

}  // namespace perikit::detail
