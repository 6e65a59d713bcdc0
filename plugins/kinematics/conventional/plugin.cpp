#include <memory>

#include "perikit/kinematics.hpp"
#include "perikit/sdk/kinematics_options.hpp"

using namespace perikit;

namespace {

/// The point gradient itself, which is a service of the engine: nothing to add.
class Conventional final : public PointKinematics {
 public:
  explicit Conventional(int order) : order_(order) {}
  int order() const noexcept override { return order_; }

 private:
  int order_;
};

PartDescription description() {
  PartDescription part{.name = "conventional",
                       .summary = "one deformation gradient per point; cheap, has zero-energy modes",
                       .parameters = {},
                       .examples = {"order = 1", "order = 2"},
                       .equations = "F_i = (sum_j omega V_j y_ij (x) xi_ij) K_i^-1,  K_i = sum_j omega V_j xi_ij (x) xi_ij\nW_i = V_i\n"
                                    "order n: g_k = omega V_k (M^-1 q(xi_k))_linear / delta, M = sum omega V q q^T, q: monomials of degree 1 ... n",
                       .source = "Partmann et al., GAMM-Mitteilungen 49 (2026) e70014, eqs. 3.31-3.35; order n: 3.43-3.53",
                       .limits = "sawtooth displacements store no energy: add a stabilization wherever fields are not smooth"};
  add_gradient_order(part.parameters);
  return part;
}

}  // namespace

PERIKIT_PLUGIN(registrar) {
  registrar.kinematics(description(), [](const ParameterValues& values, const PartFactory&) {
    return std::make_unique<Conventional>(gradient_order(values));
  });
}
