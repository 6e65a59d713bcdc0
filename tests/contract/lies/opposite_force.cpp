#include <memory>

#include "perikit/core/simd.hpp"
#include "perikit/kinematics.hpp"

using namespace perikit;

namespace {

/// A bond-based law whose force has the opposite sign of its energy's derivative.
class OppositeForce final : public PairKinematics {
 public:
  PairTraits traits() const noexcept override { return {.influence = false, .constant_moduli = true}; }
  PairModuli moduli(const PairPoint& point) const noexcept override { return {.bond = point.bulk()}; }
  std::string warning(const PairPoint&) const override { return {}; }
  const DilatationLaw* dilatation() const noexcept override { return nullptr; }
  void bond_law(const BondBatch& b) const noexcept override {
    for (int k = 0; k < b.n; k += pack_width) {
      const Pack stiffness = Pack::load(b.modulus + k) / Pack::load(b.length + k), e = Pack::load(b.extension + k);
      if (b.energy) (0.5 * stiffness * e * e).store(b.energy + k);
      if (b.force) (-1.0 * stiffness * e).store(b.force + k);
      if (b.stiffness) (-1.0 * stiffness).store(b.stiffness + k);
    }
  }
};

}  // namespace

PERIKIT_PLUGIN(registrar) {
  registrar.kinematics({.name = "opposite_force", .summary = "force = +dE/du", .parameters = {}, .examples = {""}},
                       [](const ParameterValues&, const PartFactory&) { return std::make_unique<OppositeForce>(); });
}
