#include <memory>

#include "perikit/sdk/plugin.hpp"

using namespace perikit;

namespace {

/// The point gradient itself, which is a service of the engine: nothing to add.
class Conventional final : public Kinematics {
 public:
  explicit Conventional(int order) : order_(order) {}
  KinematicsTraits traits() const noexcept override { return {.at = EvaluationPoints::points, .order = order_}; }

 private:
  int order_;
};

PartDescription description() {
  PartDescription part{.name = "conventional",
                       .summary = "one deformation gradient per point; cheap, has zero-energy modes",
                       .parameters = {},
                       .examples = {"order = 1"},
                       .equations = "F_i = (sum_j omega V_j y_ij (x) xi_ij) K_i^-1,  K_i = sum_j omega V_j xi_ij (x) xi_ij\nW_i = V_i",
                       .source = "Partmann et al., GAMM-Mitteilungen 49 (2026) e70014, eqs. 3.31-3.35",
                       .limits = "sawtooth displacements store no energy: add a stabilization wherever fields are not smooth"};
  part.parameters.integer("order", "order of the point gradient: 1, exact for affine displacements").by_default("1").at_least(1).at_most(1);
  return part;
}

}  // namespace

PERIKIT_PLUGIN(registrar) {
  registrar.kinematics(description(), [](const ParameterValues& values, const PartFactory&) {
    return std::make_unique<Conventional>(static_cast<int>(values.integer("order")));
  });
}
