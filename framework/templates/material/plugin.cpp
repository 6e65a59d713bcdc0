#include <memory>

#include "perikit/core/tensor.hpp"
#include "perikit/model/elastic_constants.hpp"
#include "perikit/sdk/law_material.hpp"
#include "perikit/sdk/plugin.hpp"

using namespace perikit;

namespace {

/// YOUR PHYSICS: a stored energy in H = F - I, written once for 3D, plane and uniaxial states and for numbers with derivatives.
/// Stress and tangent follow by exact differentiation; `template ... Tensor<T, S> P(H, k)` beside psi makes the law faster.
/// psi and P of H = 0 must be exactly zero: write them in H, not in F (perikit/core/tensor.hpp has what is needed).
struct PartName {
  static constexpr MaterialTraits traits{.constants = 2};

  /// What psi reads, from the parameters at one point; std::domain_error says what is wrong with them.
  void constants(const MaterialInput& input, double* k) const {
    const Moduli moduli = elastic_constants(input);
    k[0] = moduli.lambda;
    k[1] = moduli.mu;
  }
  /// Lame constants of the law at F = I.
  Moduli small_strain(const double* k) const noexcept { return {k[0], k[1]}; }

  /// Default: Saint Venant-Kirchhoff, psi = lambda/2 (tr E)^2 + mu E:E, E = (F^T F - I)/2.
  template <class T, class S, class K>
  T psi(const Tensor<T, S>& H, const K& k) const noexcept {
    const auto& [lambda, mu] = k;
    const Tensor<T, S> c = right_cauchy_green_minus_identity(H);  // 2 E
    const T t = trace(c);
    return 0.125 * lambda * (t * t) + 0.25 * mu * inner(c, c);
  }
};

}  // namespace

PERIKIT_PLUGIN(registrar) {
  registrar.material({.name = "part_name",
                      .summary = "one line: what it is",
                      // density, and two of the elastic constants; ParameterTable() to start from nothing.
                      .parameters = elastic_parameters(),
                      // Every example is built and tested by the contract suite.
                      .examples = {"density = 1000.0\nyoungs_modulus = 1.0e6\npoisson_ratio = 0.3"},
                      .equations = "psi = lambda/2 (tr E)^2 + mu E:E, E = (F^T F - I)/2",
                      .source = "the paper, with the number of the equation",
                      .limits = "where it must not be used"},
                     [](const ParameterValues&, const PartFactory&) { return std::make_unique<LawMaterial<PartName>>(); });
}
