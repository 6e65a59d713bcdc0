#include "perikit/material.hpp"

#include <memory>

#include "perikit/core/tensor.hpp"
#include "perikit/model/elastic_constants.hpp"
#include "perikit/sdk/law_material.hpp"

using namespace perikit;

namespace {

/// YOUR PHYSICS: a law that remembers, written once for 3D, plane and uniaxial states. Default: a standard linear solid, a spring beside a
/// spring and a dashpot in series, in Green-Lagrange strains E = (F^T F - I)/2, with the strain V of the dashpot as history:
///   psi = lambda/2 (tr E)^2 + mu E : E + m (E - V) : (E - V),   P = F dpsi/dE
///   dV/dt = (E - V)/tau,   dissipated power = 2 m (E - V) : dV/dt
struct PartName {
  static constexpr MaterialTraits traits{.constants = 4, .hyperelastic = false, .dissipates = true};
  /// What is remembered at each evaluation point, zero at the start: here V.
  template <class S>
  static constexpr std::array state{StateVariable{"viscous_strain", "-", symmetric_size<S>}};
  template <class S>
  static constexpr int size = components_of(state<S>);

  /// What the law reads, from the parameters at one point; std::domain_error says what is wrong with them.
  void constants(const MaterialInput& input, double* k) const {
    const Moduli moduli = elastic_constants(input);
    k[0] = moduli.lambda;
    k[1] = moduli.mu;
    k[2] = input.value("viscous_modulus");
    k[3] = input.value("relaxation_time");
  }
  /// Lame constants that fast waves see, since the stable time step follows from them.
  Moduli small_strain(const double* k) const noexcept { return {k[0], k[1] + k[2]}; }

  /// The step of this length [s] that begins at one history.
  template <class T, class S>
  struct Step {
    Tensor<T, S> begin;
    double time_step;

    /// Energy, stress and history at the end of the step, and what it dissipates: the implicit Euler rule for V.
    template <class K>
    HistoryUpdate<T, S, size<S>> update(const Tensor<T, S>& H, const K& k) const noexcept {
      const auto& [lambda, mu, m, tau] = k;
      const Tensor<T, S> E = green_lagrange(H), spring = (1.0 / (1.0 + time_step / tau)) * (E - begin);   // E - V at the end
      HistoryUpdate<T, S, size<S>> end;
      end.psi = 0.5 * lambda * (trace(E) * trace(E)) + mu * inner(E, E) + m * inner(spring, spring);
      end.P = P(H, k);
      end.dissipated = (2.0 * time_step / tau) * m * inner(spring, spring);
      pack_symmetric(E - spring, end.state.data());
      return end;
    }

    /// The stress alone. U also stands for numbers with derivatives, from which the tangent follows.
    template <class U, class K>
    Tensor<U, S> P(const Tensor<U, S>& H, const K& k) const noexcept {
      const auto& [lambda, mu, m, tau] = k;
      const Tensor<U, S> E = green_lagrange(H), V0 = Tensor<U, S>::map([&](int c) { return U(begin[c]); });
      const Tensor<U, S> second = add_diagonal(U(2.0 * mu) * E + U(2.0 * m / (1.0 + time_step / tau)) * (E - V0), lambda * trace(E));
      return second + H * second;
    }

    template <class U>
    static Tensor<U, S> green_lagrange(const Tensor<U, S>& H) noexcept {
      return U(0.5) * right_cauchy_green_minus_identity(H);
    }
  };

  template <class S, class T>
  Step<T, S> after(const std::array<T, size<S>>& begin, double time_step) const noexcept {
    return {unpack_symmetric<S>(begin.data()), time_step};
  }
};

/// Keys of the scene: density and two of the elastic constants, and the law's own.
ParameterTable parameters() {
  ParameterTable table = elastic_parameters();
  table.material("viscous_modulus", "Pa", "Shear modulus of the spring beside the dashpot.").by_default("0.5e6").at_least(0);
  table.material("relaxation_time", "s", "Time in which its stress falls to a share of 1/e.").by_default("1e-3").positive();
  return table;
}

}  // namespace

PERIKIT_PLUGIN(registrar) {
  registrar.material({.name = "part_name",
                      .summary = "one line: what it is",
                      .parameters = parameters(),
                      // Every example is built and tested by the contract suite.
                      .examples = {"density = 1000.0\nyoungs_modulus = 1.0e6\npoisson_ratio = 0.3",
                                   "density = 1000.0\nyoungs_modulus = 1.0e6\npoisson_ratio = 0.3\nviscous_modulus = 2.0e6\nrelaxation_time = 0.01"},
                      .equations = "psi = lambda/2 (tr E)^2 + mu E : E + m (E - V) : (E - V),  dV/dt = (E - V)/tau,  E = (F^T F - I)/2",
                      .source = "the paper, with the number of the equation",
                      .limits = "The stress depends on the path. Not for strong compression, where its stress falls."},
                     [](const ParameterValues&, const PartFactory&) { return std::make_unique<LawMaterial<PartName>>(); });
}
