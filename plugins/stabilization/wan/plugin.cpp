#include <memory>

#include "perikit/sdk/penalty_options.hpp"
#include "perikit/stabilization.hpp"

using namespace perikit;

namespace {

/// M = C4 : K^-1 with the elasticity tensor at F = I: lambda tr(K^-1) I + 2 mu K^-1.
class Wan final : public Stabilization {
 public:
  explicit Wan(PenaltyFit fit) : fit_(fit) {}
  StabilizationTraits traits() const noexcept override { return {.isotropic = false, .fit = fit_}; }
  void penalty(const PenaltyPoint& x, double* M) const noexcept override {
    const int d = dimension(x.space), components = d * (d + 1) / 2;
    double trace = 0;
    for (int c = 0; c < d; ++c) trace += x.inverse_shape[c];
    for (int c = 0; c < components; ++c) M[c] = 2 * x.moduli.mu * x.inverse_shape[c] + (c < d ? x.lame_lambda() * trace : 0.0);
  }

 private:
  PenaltyFit fit_;
};

PartDescription description() {
  PartDescription part{.name = "wan",
                       .summary = "penalty from the elasticity tensor and the shape tensor; nothing to choose, not objective",
                       .parameters = {},
                       .examples = {"", "fit = \"linear\""},
                       .equations = "T_ij += omega (C4 : K_i^-1) z_ij,  z_ij = y_ij - F_i xi_ij (order n: - its fit),  C4: elasticity tensor at F = I in the space of the body\n"
                                    "isotropic solids: C4 : K^-1 = lambda tr(K^-1) I + 2 mu K^-1",
                       .source = "Wan, Chen, Chu and Liu, Acta Mech. Sinica 35 (2019) 1021-1032; Partmann et al., GAMM-Mitteilungen 49 (2026) e70014, eqs. 4.13-4.14",
                       .limits = "over `conventional` only; where K_i is not a multiple of I (surfaces, cracks, irregular clouds) the penalty is not objective "
                                 "and does not keep angular momentum: for small rotations there; silling turns with the body"};
  add_penalty_fit(part.parameters);
  return part;
}

}  // namespace

PERIKIT_PLUGIN(registrar) {
  registrar.stabilization(description(), [](const ParameterValues& values, const PartFactory&) { return std::make_unique<Wan>(penalty_fit(values)); });
}
