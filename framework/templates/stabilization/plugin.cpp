#include <memory>

#include "perikit/stabilization.hpp"

using namespace perikit;

namespace {

/// YOUR PHYSICS: the stiffness M_i of a penalty on z_ij = u_ij - Hbar_i xi_ij, what the point gradient leaves over of a bond,
///   E = 1/2 sum_i V_i sum_j V_j omega_ij z_ij . M_i z_ij.
/// The engine makes forces and tangents of it (perikit/model/stabilization.hpp).
class PartName final : public Stabilization {
 public:
  explicit PartName(double coefficient) : coefficient_(coefficient) {}

  /// isotropic: M_i = m_i I, one number; keeps angular momentum. Otherwise M has the components of a symmetric tensor.
  StabilizationTraits traits() const noexcept override { return {.isotropic = true}; }

  /// Default: springs as stiff as those of a bond-based solid of the same bulk modulus.
  void penalty(const PenaltyPoint& x, double* M) const noexcept override {
    M[0] = coefficient_ * x.micromodulus() / x.horizon / x.mean_influence;
  }

 private:
  double coefficient_;
};

ParameterTable parameters() {
  ParameterTable table;
  table.number("coefficient", "-", "Stiffness of the penalty relative to a bond-based solid.").by_default("1.0").positive();
  return table;
}

}  // namespace

PERIKIT_PLUGIN(registrar) {
  registrar.stabilization({.name = "part_name",
                           .summary = "one line: what it is",
                           .parameters = parameters(),
                           // Every example is built and tested by the contract suite.
                           .examples = {"", "coefficient = 0.25"},
                           .equations = "T_ij = coefficient c/(delta omega_mean_i) omega_ij z_ij, c the micromodulus of the bond-based solid",
                           .source = "the paper, with the number of the equation",
                           .limits = "where it must not be used"},
                          [](const ParameterValues& values, const PartFactory&) { return std::make_unique<PartName>(values.number("coefficient")); });
}
