#include "perikit/kinematics.hpp"
#include "perikit/sdk/kinematics_options.hpp"

namespace {

using namespace perikit;

/// Any bond-level or sub-horizon kinematics with the volume change of the owner.
class Selective final : public MappedKinematics {
 public:
  explicit Selective(std::unique_ptr<Kinematics> base) : base_(std::move(base)) {}
  GradientMap map() const noexcept override { return GradientMap::selective; }
  const Kinematics& base() const noexcept override { return *base_; }

 private:
  std::unique_ptr<Kinematics> base_;
};

/// A base with another force state than its own.
class OtherForceState final : public WeightedKinematics {
 public:
  OtherForceState(std::unique_ptr<Kinematics> owned, const WeightedKinematics& base, ForceState state)
      : owned_(std::move(owned)), base_(base), state_(state) {}
  WeightedTraits traits() const noexcept override {
    WeightedTraits traits = base_.traits();
    traits.force_state = state_;
    return traits;
  }
  int parts(int dimension) const override { return base_.parts(dimension); }
  void weights(const FamilyView& family, double* omega, std::size_t stride) const noexcept override {
    base_.weights(family, omega, stride);
  }

 private:
  std::unique_ptr<Kinematics> owned_;
  const WeightedKinematics& base_;
  ForceState state_;
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
       .examples = {"base = \"baqp\"", "base = { type = \"non_spherical\", n1 = 1.0, n2 = 1.0 }", "base = { type = \"projection\", order = 2 }",
                    "base = \"sub_horizon\"", "base = \"bond_associated\"\nforce_state = \"local\""},
       .equations = "Fh = (Jbar_i / Jt_q)^(1/3) Ft_q, Ft_q from the base, "
                    "Jbar_i from the point gradient of the owner i (of the order of the base)\n"
                    "forces and tangent by the exact chain rule of Fh(Ft, Fbar)",
       .source = "Scabbia et al., eqs. 24-30, in variational form",
       .limits = "Not in plane or uniaxial stress; not over a base with evaluation points at points."},
      [](const ParameterValues& values, const PartFactory& factory) -> std::unique_ptr<Kinematics> {
        std::unique_ptr<Kinematics> base = factory.kinematics(values.part("base"));
        const std::string& type = values.part("base").type;
        const auto refuse = [&](const std::string& key, const std::string& found, const std::string& allowed) {
          throw values.error(key, "found '" + found + "; allowed: " + allowed);
        };
        const auto* const weighted = dynamic_cast<const WeightedKinematics*>(base.get());
        if (dynamic_cast<const MappedKinematics*>(base.get())) refuse("base", type + "' itself", "a kinematics with bonds or sub-horizons");
        if (!weighted && !dynamic_cast<const BondKinematics*>(base.get())) {
          refuse("base", type + "', which has no evaluation points at bonds or sub-horizons", "a kinematics with bonds or sub-horizons");
        }
        // A local base passes its force state on.
        const ForceState own = weighted ? weighted->traits().force_state : ForceState::variational;
        const ForceState wanted = values.given("force_state") ? force_state(values) : own;
        if (wanted == ForceState::local && (!weighted || weighted->parts(3) != 0)) {
          refuse("force_state", "local' over '" + type + "'",
                 "'variational', or a base with a domain for each bond (bond_associated, non_spherical)");
        }
        if (wanted != own) base = std::make_unique<OtherForceState>(std::move(base), *weighted, wanted);
        return std::make_unique<Selective>(std::move(base));
      });
}
