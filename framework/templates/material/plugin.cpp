#include "perikit/material.hpp"

#include <memory>

#include "perikit/core/tensor.hpp"
#include "perikit/model/elastic_constants.hpp"
#include "perikit/sdk/law_material.hpp"

using namespace perikit;

namespace {

/// YOUR PHYSICS: a stored energy in H = F - I, written once for 3D, plane and uniaxial states and for numbers with derivatives.
/// Stress and tangent follow by exact differentiation; `template ... Tensor<T, S> P(H, k)` beside psi makes the law faster.
/// T holds several points at once: a law branches by select(a < b, x, y), and sqrt, max and their like are written without std::
/// (framework/docs/scalars.md).
/// What rounding leaves of psi and P at H = 0 is taken off by the framework.
struct PartName {
  static constexpr MaterialTraits traits{.constants = 3};

  /// What psi reads, from the parameters at one point; std::domain_error says what is wrong with them.
  void constants(const MaterialInput& input, double* k) const {
    const Moduli moduli = elastic_constants(input);
    k[0] = moduli.mu;
    k[1] = moduli.bulk();
    k[2] = input.value("stiffening");
  }
  /// Lame constants of the law at F = I.
  Moduli small_strain(const double* k) const noexcept { return {k[1] - 2 * k[0] / 3, k[0]}; }

  /// Default: Yeoh's rubber with two terms, I = J^(-2/3) tr C the first invariant without the change of volume.
  template <class T, class S, class K>
  T psi(const Tensor<T, S>& H, const K& k) const noexcept {
    const auto& [mu, kappa, stiffening] = k;
    const T j = jacobian_minus_one(H), trace_C = 3.0 + 2.0 * trace(H) + inner(H, H);
    const T i = trace_C / rational_power<2, 3>(T(1.0 + j)) - 3.0;
    return 0.5 * mu * (i + stiffening * (i * i)) + 0.5 * kappa * (j * j);
  }
};

/// Keys of the scene: density and two of the elastic constants, and the law's own.
ParameterTable parameters() {
  ParameterTable table = elastic_parameters();
  table.material("stiffening", "-", "Share of the square of I - 3 in the energy.").by_default("0.1").at_least(0);
  return table;
}

}  // namespace

PERIKIT_PLUGIN(registrar) {
  registrar.material({.name = "part_name",
                      .summary = "one line: what it is",
                      .parameters = parameters(),
                      // Every example is built and tested by the contract suite.
                      .examples = {"density = 1000.0\nyoungs_modulus = 1.0e6\npoisson_ratio = 0.3",
                                   "density = 1000.0\nyoungs_modulus = 1.0e6\npoisson_ratio = 0.45\nstiffening = 0.5"},
                      .equations = "psi = mu/2 ((I - 3) + stiffening (I - 3)^2) + kappa/2 (J - 1)^2, I = J^(-2/3) tr C",
                      .source = "the paper, with the number of the equation",
                      .limits = "where it must not be used"},
                     [](const ParameterValues&, const PartFactory&) { return std::make_unique<LawMaterial<PartName>>(); });
}
