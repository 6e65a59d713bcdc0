#include "perikit/damage.hpp"

#include <fmt/format.h>

#include <cmath>
#include <stdexcept>

#include "perikit/core/simd.hpp"

using namespace perikit;

namespace {

/// The energy of a bond, of bonds in extension alone, against the one at which the bonds that cross a unit of area have Gc.
class CriticalEnergy final : public Damage {
 public:
  CriticalEnergy(double energy_release_rate, double softening, bool shared, bool released)
      : energy_release_rate_(energy_release_rate), softening_(softening), shared_(shared), released_(released) {}

  DamageTraits traits() const noexcept override {
    return {.bits = softening_ == 1,
            .energy = true,
            .bound = shared_ ? ValueBound::energy_over_share : ValueBound::energy,
            .by_limits = true,
            .released = released_};
  }

  DamageLimits limits(const DamagePoint& x) const override {
    const double limit = energy_release_rate_ / (shared_ ? x.crossing_shares : x.crossing);
    if (!(limit > 0) || !std::isfinite(limit))
      throw std::domain_error(
          fmt::format("found energy_release_rate = {}, which gives bonds a critical energy of {} with this family and "
                      "influence function; allowed: one that gives a finite energy > 0",
                      energy_release_rate_, limit));
    return {limit / softening_, limit * softening_};
  }

  void measure(const BondStates& b) const noexcept override {
    for (int k = 0; k < b.n; ++k) b.value[k] = b.stretch[k] > 0 ? b.energy[k] / (shared_ ? b.share[k] : 1.0) : 0.0;
  }

  void integrity(const IntegrityBatch& b) const noexcept override {
    for (int k = 0; k < b.n; ++k) b.integrity[k] = left(b.value[k], b.onset[k], b.failure[k]);
  }

 private:
  /// b of a bond that holds w without it, whose force b q falls from q = first to 0 at q = last in a straight line, q = w^(1/2). On the way it
  /// takes up int q^2 (-db) = first last.
  static double left(double w, double onset, double failure) noexcept {
    if (w <= onset) return 1;
    if (w >= failure) return 0;
    const double q = std::sqrt(w), first = std::sqrt(onset), last = std::sqrt(failure);
    return first / q * (last - q) / (last - first);
  }

  double energy_release_rate_, softening_;
  bool shared_, released_;
};

PartDescription description() {
  PartDescription part{
      .name = "critical_energy",
      .summary = "a bond breaks for good once it holds more energy than its part of Gc, or weakens for as much",
      .parameters = {},
      .examples = {"energy_release_rate = 0.05", "energy_release_rate = 0.05\nlimit = \"equal\"", "energy_release_rate = 0.05\nsoftening = 4.0"},
      .equations =
          "b = 0 once w_ij > w_c(xi) and s > 0,  w_ij = dE/db_ij (released) or the share of the bond in E (held), over V_i V_j\n"
          "shared: w_c = Gc omega(xi)/(sum omega xi.n V_j over the bonds with xi.n > 0)\n"
          "equal:  w_c = Gc/(sum xi.n V_j over these) -> 4 Gc/(pi delta^4) (3D), 3 Gc/(2 h delta^3) (2D)\n"
          "softening r: b = (r^1/2 - q)/(q (r - 1)), q = (w_ij/w_c)^1/2 from r^-1/2 to r^1/2, the largest so far",
      .source = "Foster, Silling, Chen, International Journal for Multiscale Computational Engineering 9 (2011) 675",
      .limits = "bonds that are shorter than at rest never break"};
  part.parameters.number("energy_release_rate", "J/m^2", "Gc: energy that a new crack takes per area.").require().positive();
  part.parameters
      .number("softening", "-",
              "Stretch at which a bond is gone over the one at which it begins to weaken, in a straight line and for the same energy; 1: at once.")
      .by_default("1.0")
      .at_least(1)
      .at_most(1e3);
  part.parameters
      .choice("limit", {"shared", "equal"},
              "Critical energies of near and far bonds: in proportion to what they hold in a homogeneous expansion, or equal.")
      .by_default("\"shared\"");
  part.parameters
      .choice("energy", {"released", "held"},
              "Energy of a bond: what the body gives up per b of it, displacements held (of pair laws and where it is not known: held), or its share.")
      .by_default("\"released\"");
  return part;
}

}  // namespace

PERIKIT_PLUGIN(registrar) {
  registrar.damage(description(), [](const ParameterValues& values, const PartFactory&) {
    return std::make_unique<CriticalEnergy>(values.number("energy_release_rate"), values.number("softening"), values.text("limit") == "shared", values.text("energy") == "released");
  });
}
