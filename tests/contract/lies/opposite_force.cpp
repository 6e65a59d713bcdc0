#include <memory>

#include "perikit/core/simd.hpp"
#include "perikit/sdk/plugin.hpp"

using namespace perikit;

namespace {

/// A bond-based law whose force has the opposite sign of its energy's derivative.
class OppositeForce final : public Kinematics {
 public:
  KinematicsTraits traits() const noexcept override { return {.at = EvaluationPoints::pairs, .influence = false, .constant_moduli = true}; }
  PairModuli pair_moduli(const PairPoint& point) const noexcept override { return {.bond = point.bulk()}; }
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
