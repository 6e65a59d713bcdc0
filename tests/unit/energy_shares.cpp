/// Shares of the energy of a family, of every bond of it, however many there are.

#include "terms/pairs/pair_energy_shares.hpp"

#include <doctest/doctest.h>

#include <string>

#include "perikit/core/field.hpp"

using namespace perikit;

namespace {

/// phi = omega e^2/(2 r): in a homogeneous expansion by s a bond stores omega s^2 r/2.
class Springs final : public PairKinematics {
 public:
  PairTraits traits() const noexcept override { return {.influence = true, .constant_moduli = true}; }
  PairModuli moduli(const PairPoint&) const noexcept override { return {}; }
  std::string warning(const PairPoint&) const override { return {}; }
  void bond_law(const BondBatch& b) const noexcept override {
    for (int k = 0; k < b.n; ++k) b.energy[k] = b.modulus[k] * b.omega[k] * b.extension[k] * b.extension[k] / (2 * b.length[k]);
  }
  const DilatationLaw* dilatation() const noexcept override { return nullptr; }
};

}  // namespace

TEST_CASE("energy shares: of every bond of a pair law, in proportion to what it stores in a homogeneous expansion") {
  for (const int bonds : {1, 7, 128, 129, 300}) {
    INFO(bonds, " bonds");
    const std::size_t size = padded(static_cast<std::size_t>(bonds));
    AlignedVector<double> length(size, 1.0), omega(size, 1.0), share(size, -1.0);
    for (std::size_t k = 0; k < static_cast<std::size_t>(bonds); ++k) {
      length[k] = 0.5 + 0.01 * static_cast<double>(k);
      omega[k] = 2.0 - 0.003 * static_cast<double>(k);
    }
    pair_energy_shares(Springs(), bonds, length.data(), omega.data(), share.data());
    for (std::size_t k = 0; k < static_cast<std::size_t>(bonds); ++k) CHECK(share[k] == doctest::Approx(omega[k] * length[k]).epsilon(1e-12));
  }
}
