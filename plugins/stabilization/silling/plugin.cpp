#include <memory>

#include "perikit/sdk/penalty_options.hpp"
#include "perikit/stabilization.hpp"

using namespace perikit;

namespace {

/// Springs on the leftover of every bond, as stiff as those of the bond-based solid: C = c_bond / delta.
class Silling final : public Stabilization {
 public:
  Silling(double coefficient, PenaltyFit fit) : coefficient_(coefficient), fit_(fit) {}
  StabilizationTraits traits() const noexcept override { return {.isotropic = true, .fit = fit_}; }
  void penalty(const PenaltyPoint& x, double* M) const noexcept override {
    M[0] = coefficient_ * x.micromodulus() / x.horizon / x.mean_influence;
  }

 private:
  double coefficient_;
  PenaltyFit fit_;
};

PartDescription description() {
  PartDescription part{.name = "silling",
                       .summary = "springs on what the point gradient leaves of each bond; objective, one coefficient to choose",
                       .parameters = {},
                       .examples = {"", "coefficient = 0.25", "fit = \"linear\""},
                       .equations = "T_ij += G C (omega/omega_mean_i) z_ij,  z_ij = y_ij - F_i xi_ij (order n: - its fit),  omega_mean_i = sum_j omega V_j / sum_j V_j\n"
                                    "C = 18 K/(pi delta^5) (3D), 12 k'/(pi h delta^4) (2D), 2 E/(A delta^3) (1D),  G: coefficient",
                       .source = "Silling, Comput. Methods Appl. Mech. Engrg. 322 (2017) 42-57; Hashim et al. (2D constants, eqs. 39-40)",
                       .limits = "over `conventional` only; a coefficient far above 1 locks bending and shortens the stable time step"};
  part.parameters.number("coefficient", "-", "G: stiffness of the penalty relative to a bond-based solid of the same bulk modulus").by_default("1.0").positive();
  add_penalty_fit(part.parameters);
  return part;
}

}  // namespace

PERIKIT_PLUGIN(registrar) {
  registrar.stabilization(description(), [](const ParameterValues& values, const PartFactory&) {
    return std::make_unique<Silling>(values.number("coefficient"), penalty_fit(values));
  });
}
