#include <memory>
#include <optional>

#include "perikit/kinematics.hpp"
#include "perikit/sdk/kinematics_options.hpp"

using namespace perikit;

namespace {

/// The point gradient itself, which is a service of the engine: nothing to add.
class Conventional final : public PointKinematics {
 public:
  Conventional(int order, std::optional<bool> cell_moments) : order_(order), cell_moments_(cell_moments) {}
  int order() const noexcept override { return order_; }
  std::optional<bool> cell_moments() const noexcept override { return cell_moments_; }

 private:
  int order_;
  std::optional<bool> cell_moments_;
};

PartDescription description() {
  PartDescription part{.name = "conventional",
                       .summary = "one deformation gradient per point; cheap, has zero-energy modes",
                       .parameters = {},
                       .examples = {"order = 1", "order = 2", "order = 2\ncell_moments = false"},
                       .equations = "F_i = (sum_j omega V_j y_ij (x) xi_ij) K_i^-1,  K_i = sum_j omega V_j xi_ij (x) xi_ij\nW_i = V_i\n"
                                    "order n: g_k = omega V_k (M^-1 q(xi_k))_linear / delta, M = sum omega V q q^T, q: monomials of degree 1 ... n\n"
                                    "cell_moments: W_q = V_i/(2 d), F_q = gradient of the same fit at X_i +- h sqrt(d/12) e_a",
                       .source = "Partmann et al., GAMM-Mitteilungen 49 (2026) e70014, eqs. 3.31-3.35; order n: 3.43-3.53",
                       .limits = "sawtooth displacements store no energy: add a stabilization wherever fields are not smooth"};
  add_gradient_order(part.parameters);
  part.parameters.boolean("cell_moments",
                          "whether the second moments of the points' cells count: 2 d evaluation points a cell, at X_i +- h sqrt(d/12) e_a, with the gradient there of the fit; "
                          "left out: on lattices over orders above 1");
  return part;
}

}  // namespace

PERIKIT_PLUGIN(registrar) {
  registrar.kinematics(description(), [](const ParameterValues& values, const PartFactory&) {
    return std::make_unique<Conventional>(gradient_order(values), values.has("cell_moments") ? std::optional(values.boolean("cell_moments")) : std::nullopt);
  });
}
