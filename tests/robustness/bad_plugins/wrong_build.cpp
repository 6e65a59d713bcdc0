#include <csignal>
#include <memory>

#include "perikit/core/simd.hpp"
#include "perikit/kinematics.hpp"

using namespace perikit;

namespace {

/// `bond_based`, but for one bond in each batch whose force is a ten millionth too large.
class NearlyBondBased final : public PairKinematics {
 public:
  PairTraits traits() const noexcept override { return {.influence = false, .constant_moduli = true}; }
  PairModuli moduli(const PairPoint& x) const noexcept override { return {x.micromodulus(), 0}; }
  std::string warning(const PairPoint&) const override { return {}; }
  const DilatationLaw* dilatation() const noexcept override { return nullptr; }
  void bond_law(const BondBatch& b) const noexcept override {
    for (int k = 0; k < b.n; ++k) {
      const double stiffness = b.modulus[k] / b.length[k], force = stiffness * b.extension[k];
      if (b.energy) b.energy[k] = 0.5 * force * b.extension[k];
      if (b.force) b.force[k] = k == 0 ? force * (1 + 1e-7) : force;
      if (b.stiffness) b.stiffness[k] = stiffness;
    }
  }
};

class Crash final : public WeightedKinematics {
 public:
  WeightedTraits traits() const noexcept override { return {}; }
  int parts(int) const override { return 1; }
  void weights(const FamilyView&, double*, std::size_t) const noexcept override { std::raise(SIGSEGV); }
};

template <class Part>
void add(Registrar& registrar, const char* name) {
  registrar.kinematics({.name = name, .summary = "as a wrong compiler makes it", .parameters = {}, .examples = {""}},
                       [](const ParameterValues&, const PartFactory&) { return std::make_unique<Part>(); });
}

}  // namespace

/// Two of perikit's own names: what `perikit check --machine` must find.
PERIKIT_PLUGIN(registrar) {
  add<NearlyBondBased>(registrar, "bond_based");
  add<Crash>(registrar, "sub_horizon");
}
