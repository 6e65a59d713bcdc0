#pragma once
/// Laws with history (rate laws): what they add to a point law of perikit/sdk/law_material.hpp.
///
///   struct MyRateLaw {
///     static constexpr MaterialTraits traits{.constants = 2, .hyperelastic = false};
///     /// What it remembers, by name.
///     template <class S> static constexpr std::array state{StateVariable{"stress", "Pa", symmetric_size<S>}, StateVariable{"energy", "J/m^3", 1}};
///     /// The step that begins at these values: a point law with P(H, k) and tangent(H, k), and with
///     /// update(H, k) -> HistoryUpdate<T, S, state_size<MyRateLaw, S>()>, H at the end of the step.
///     template <class S, class T> auto after(const std::array<T, components_of(state<S>)>& begin) const noexcept;
///     /// or, for laws of rates: time_step is the length of the step [s], 0 where no step is taken (samples), so that nothing relaxes
///     template <class S, class T> auto after(const std::array<T, components_of(state<S>)>& begin, double time_step) const noexcept;
///   };
///
/// All values are zero at the start: store differences from it (U - I, not U).
///
/// Energy: the work of P on a step is what psi grows by and what is dissipated. A law that loses energy (viscosity, plasticity)
/// declares traits.dissipates, lets psi be what it stores and puts the rest into HistoryUpdate::dissipated; the run adds it up.
/// Other laws leave that out: their psi is the work done so far.
///
/// A step may be too long for a law: an iteration of its own does not end, or strains grow by more than its update is made for. Such a law declares
/// traits.limits_step and says in HistoryUpdate::step_factor what share of the step would do. Quasi-static runs then take the step again, as much shorter; explicit ones
/// end.

#include <array>

#include "perikit/core/simd.hpp"
#include "perikit/core/tensor.hpp"
#include "perikit/model/material.hpp"

namespace perikit {

/// What a step ends with: energy, stress, and the history from which the next step begins.
template <class T, class S, int size>
struct HistoryUpdate {
  T psi;
  Tensor<T, S> P;
  std::array<T, size> state;
  T dissipated = 0.0;   ///< in this step [J/m^3]; with traits.dissipates
  T step_factor = 1.0;  ///< above 0; below 1 the step was too long; with traits.limits_step
};

template <class Law>
concept HasHistory = requires {
  Law::template state<Solid>;
};

template <class Law>
concept HasTimeStep = requires(const Law& law, const std::array<Pack, components_of(Law::template state<Solid>)>& state) {
  law.template after<Solid>(state, 1.0);
};

template <class Law, class S>
constexpr int state_size() noexcept {
  if constexpr (HasHistory<Law>)
    return components_of(Law::template state<S>);
  else
    return 0;
}

/// Components of a symmetric tensor: 6, 4 (xx xy yy zz) or 3.
template <class S>
inline constexpr int symmetric_size = S::dimension == 3   ? 6
                                      : S::dimension == 2 ? 4
                                                          : 3;

/// The components i <= j of a, in the order of the space.
template <class T, class S>
void pack_symmetric(const Tensor<T, S>& a, T* to) noexcept {
  int n = 0;
  PERIKIT_UNROLL for (int k = 0; k < S::components; ++k) if (row<S>(k) <= column<S>(k)) to[n++] = a[k];
}

template <class S, class T>
Tensor<T, S> unpack_symmetric(const T* from) noexcept {
  constexpr auto places = [] {
    std::array<int, S::components> place{};
    int n = 0;
    for (int k = 0; k < S::components; ++k)
      if (row<S>(k) <= column<S>(k)) {
        place[k] = n;
        place[component<S>(column<S>(k), row<S>(k))] = n++;
      }
    return place;
  }();
  return Tensor<T, S>::map([&](int k) { return from[places[k]]; });
}

}  // namespace perikit
