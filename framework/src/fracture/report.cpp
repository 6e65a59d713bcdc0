// What a run is told of bonds that fail: before it begins, and at its end.
#include <fmt/format.h>

#include "fracture/failure_energy.hpp"
#include "fracture/fracture.hpp"
#include "fracture/search/bond_release.hpp"
#include "perikit/core/communicator.hpp"
#include "perikit/core/warnings.hpp"
#include "terms/terms.hpp"

namespace perikit {

namespace {

/// Criteria by energy where a bond takes more than it holds (framework/docs/fracture.md, "What a crack costs").
void warn_of_cost(const TermParts& parts, const BodyDamage& damage, ModelReport& report) {
  const DamageTraits asked = asked_of_bonds(parts, *damage.law);
  if (!asked.energy || asked.released || parts.formulation.pairs) return;
  const char* const unknown = BondRelease::unknown(parts);
  report.warnings.push_back(named("crack_cost", fmt::format("a criterion by the energy that bonds hold, with gradients: a bond takes more than it holds, and cracks cost 1.4 to 5 "
                                        "times Gc and more; {}; what they cost is measured in fracture.md, \"What a crack costs\"",
                                        unknown ? fmt::format("what bonds set free is not known {}", unknown)
                                                : "by the energy that bonds set free (energy = \"released\") they cost Gc")));
}

/// Where bonds that fail would create energy: framework/docs/fracture.md, "Bonds that stay".
void warn_of_energy(const TermParts& parts, const BodyDamage& damage, ModelReport& report) {
  const bool stabilized = parts.stabilization != nullptr;
  const char* const what = creates_energy(parts.formulation, stabilized, parts.families->body().dimension());
  if (!what) return;
  if (!damage.second_law)
    report.warnings.push_back(named("second_law", fmt::format(
        "{}: updates of bonds that fail create energy, unless damage.second_law is true; how much is measured in fracture.md, "
        "\"Every kinematics and kernel\"",
        what)));
  else if (parts.formulation.point && !stabilized)
    report.warnings.push_back(named("second_law", fmt::format(
        "{}: most bonds beyond their limit stay, as their failure would raise the energy of zero-energy modes; cracks need a "
        "stabilization (fracture.md, \"Bonds that stay\")",
        what)));
}

}  // namespace

void Fracture::report(ModelReport& report) const {
  report.bytes += finder_->bytes();
  warn_of_energy(terms_.parts(), *damage_, report);
  warn_of_cost(terms_.parts(), *damage_, report);
}

BondChecks Fracture::checks() const {
  std::int64_t counts[4] = {static_cast<std::int64_t>(updates_ * finder_->groups()),
                            static_cast<std::int64_t>(finder_->checked()), 0, 0};
  for (const BondChange& change : families_.changed())
    if (families_.body().owns(static_cast<std::size_t>(change.bond.point))) ++counts[change.integrity == 0 ? 2 : 3];
  communicator().sum(counts);
  const auto count = [&](std::size_t k) { return static_cast<std::size_t>(counts[k]); };
  return {updates_, count(0), count(1), count(2), count(3)};
}

std::string Fracture::summary(double dissipated) const {
  const BondChecks checks = this->checks();
  std::string text =
      fmt::format("failed bonds  {}, weakened {}, dissipated {:.6g} J\n", checks.failed, checks.weakened, dissipated);
  if (checks.groups > 0) {
    text += fmt::format(
        "bond checks   {} of {} groups of eight points in {} updates ({:.2f} %); the others were too far from failing\n",
        checks.checked, checks.groups, checks.updates,
        100.0 * static_cast<double>(checks.checked) / static_cast<double>(checks.groups));
  }
  const BondAccount& a = account_;
  if (a.gains > 0) {
    text += named("second_law", fmt::format("warning       {} updates of bonds raised the strain energy, by {:.6g} J in all; the others took {:.6g} J",
                                            a.gains, a.gained, dissipated + a.gained)) + "\n";
  }
  if (a.held > 0)
    text +=
        fmt::format("bonds held    {} times a bond beyond its limit stayed, as its failure would have created energy\n", a.held);
  if (a.inside_out > 0) {
    text += named("inside_out", fmt::format("warning       {} times points were turned inside out where bonds failed: the energy and the impulse of these bonds are lost",
                                            a.inside_out)) + "\n";
  }
  return text;
}

}  // namespace perikit
