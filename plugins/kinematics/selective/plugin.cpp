#include "perikit/sdk/kinematics_options.hpp"
#include "perikit/sdk/plugin.hpp"

namespace {

using namespace perikit;

/// Any bond-level or sub-horizon kinematics with the volume change of the owner.
class Selective final : public Kinematics {
 public:
  Selective(std::unique_ptr<Kinematics> base, ForceState force_state) : base_(std::move(base)), force_state_(force_state) {}
  KinematicsTraits traits() const noexcept override {
    KinematicsTraits traits = base_->traits();
    traits.selective = true;
    traits.force_state = force_state_;
    return traits;
  }
  int parts(int dimension) const override { return base_->parts(dimension); }
  void correction(const FamilyView& family, double* g, std::size_t stride) const noexcept override { base_->correction(family, g, stride); }
  void weights(const FamilyView& family, double* omega, std::size_t stride) const noexcept override { base_->weights(family, omega, stride); }

 private:
  std::unique_ptr<Kinematics> base_;
  ForceState force_state_;
};

}  // namespace

PERIKIT_PLUGIN(registrar) {
  ParameterTable table;
  table.part("base", Kind::kinematics, "The kinematics whose evaluation points keep their own shape change.").require();
  add_force_state(table);
  registrar.kinematics(
      {.name = "selective",
       .summary = "any bond-level kinematics with the volume change of the whole family: no volumetric locking",
       .parameters = std::move(table),
       .examples = {"base = \"baqp\"", "base = { type = \"non_spherical\", n1 = 1.0, n2 = 1.0 }", "base = { type = \"projection\", order = 2 }", "base = \"sub_horizon\"", "base = \"bond_associated\"\nforce_state = \"local\""},
       .equations = "Fh = (Jbar_i / Jt_q)^(1/3) Ft_q, Ft_q from the base, Jbar_i from the point gradient of the owner i (of the order of the base)\n"
                    "forces and tangent by the exact chain rule of Fh(Ft, Fbar)",
       .source = "Scabbia et al., eqs. 24-30, in variational form",
       .limits = "Not in plane or uniaxial stress; not over a base with evaluation points at points."},
      [](const ParameterValues& values, const PartFactory& factory) -> std::unique_ptr<Kinematics> {
        std::unique_ptr<Kinematics> base = factory.kinematics(values.part("base"));
        const KinematicsTraits traits = base->traits();
        if (traits.at == EvaluationPoints::points || traits.at == EvaluationPoints::pairs) {
          throw values.error("base", "found '" + values.part("base").type + "', which has no evaluation points at bonds or sub-horizons; allowed: a kinematics with bonds or sub-horizons");
        }
        if (traits.selective) throw values.error("base", "found 'selective' itself; allowed: a kinematics with bonds or sub-horizons");
        // A local base passes its force state on.
        const ForceState wanted = values.given("force_state") ? force_state(values) : traits.force_state;
        if (wanted == ForceState::local && (traits.at != EvaluationPoints::weighted || base->parts(3) != 0)) {
          throw values.error(
              "force_state",
              "found 'local' over '" + values.part("base").type +
                  "'; allowed: 'variational', or a base with a domain for each bond (bond_associated, non_spherical)");
        }
        return std::make_unique<Selective>(std::move(base), wanted);
      });
}
