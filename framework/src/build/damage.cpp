#include "build/damage.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "families/families.hpp"
#include "perikit/core/communicator.hpp"
#include "perikit/problem/ghosts.hpp"

namespace perikit {

namespace {

/// <xi> = int omega xi^d / int omega xi^(d-1) over (0, delta), by the midpoint rule.
double mean_bond_length(const InfluenceFunction& influence, int dimension, double horizon) {
  constexpr std::size_t steps = 20000;
  std::vector<double> r(steps), omega(steps);
  for (std::size_t k = 0; k < steps; ++k) r[k] = (static_cast<double>(k) + 0.5) / steps;
  influence.evaluate(r, omega);
  double above = 0, below = 0;
  for (std::size_t k = 0; k < steps; ++k) {
    const double weight = omega[k] * std::pow(r[k], dimension - 1);
    above += weight * r[k];
    below += weight;
  }
  return above / below * horizon;
}

/// Of Rayleigh waves, by Viktorov's approximation [m/s]; 0 without a density, which is asked for with the masses.
double rayleigh_speed(const Moduli& moduli, double density) {
  const double nu = moduli.poisson();
  return density > 0 ? std::sqrt(moduli.mu / density) * (0.862 + 1.14 * nu) / (1 + nu) : 0.0;
}

void refuse_unsuited(const Scene& scene, const Formulation& formulation) {
  const auto refuse = [&](const std::string& found, const std::string& allowed) {
    throw InputError(scene.damage->values.position(""), "damage", fmt::format("found with {}; allowed: {}", found, allowed));
  };
  if (formulation.force_state == ForceState::local) refuse("kinematics.force_state = \"local\"", "\"variational\"");
}

}  // namespace

namespace {

/// Whether failed bonds let go in the course of several steps; refused where they cannot.
bool gradual(const Scene& scene, const Damage& criterion, bool quasi_static) {
  const ParameterValues& values = scene.damage->values;
  if (!values.has("gradual") || !values.boolean("gradual")) return false;
  const auto refuse = [&](const std::string& found, const char* allowed) {
    throw InputError(values.position("gradual"), "damage.gradual",
                     fmt::format("found true with {}; allowed: {}", found, allowed));
  };
  if (!criterion.traits().bits)
    refuse(fmt::format("\"{}\", whose bonds weaken of themselves", scene.damage->type), "criteria that break bonds at once");
  if (quasi_static) refuse(fmt::format("integrator \"{}\", which knows no time", scene.integrator->type), "explicit integrators");
  return true;
}

}  // namespace

std::unique_ptr<const BodyDamage> build_damage(const Scene& scene, const PartFactory& factory, const TermParts& parts,
                                               const ImageMap* images, const Partition* partition, bool quasi_static) {
  if (!scene.damage) return nullptr;
  auto damage = std::make_unique<BodyDamage>();
  damage->law = factory.damage(*scene.damage);
  const bool gradually = gradual(scene, *damage->law, quasi_static);
  refuse_unsuited(scene, parts.formulation);
  const Body& body = parts.families->body();
  const Laws& laws = *parts.laws;
  damage->onset = body.make_field(1);
  damage->failure = body.make_field(1);
  if (gradually) damage->crack_speed = body.make_field(1);
  DamagePoint at{{body.space(), body.section(), body.horizon(), {}},
                 mean_bond_length(*parts.families->influence(), body.dimension(), body.horizon())};
  const bool uniform = laws.records().size() == 1 && laws.records().front().uniform;
  StretchLimits limits;
  bool equal = true;
  for (std::size_t k = 0; k < body.owned().size(); ++k) {
    const auto p = static_cast<std::size_t>(body.owned()[k]);
    if (k == 0 || !uniform) {
      at.moduli = laws.moduli(p);
      try {
        limits = damage->law->limits(at);
      } catch (const std::domain_error& error) {
        throw InputError(scene.damage->values.position(""), "damage", error.what());
      }
    }
    damage->onset.data()[p] = limits.onset;
    damage->failure.data()[p] = limits.failure;
    if (gradually) damage->crack_speed.data()[p] = rayleigh_speed(at.moduli, laws.density(p));
    equal = equal && limits.onset == limits.failure;
  }
  for (const std::string& set : scene.no_fail)
    for (const std::int32_t p : body.set(set))
      damage->onset.data()[p] = damage->failure.data()[p] = std::numeric_limits<double>::infinity();
  if (images)
    for (Field* field : {&damage->onset, &damage->failure, &damage->crack_speed})
      if (field->size() > 0) images->copy_from_sources(*field);
  if (partition) {
    Ghosts ghosts(*partition, body, 1);
    for (Field* field : {&damage->onset, &damage->failure, &damage->crack_speed})
      if (field->size() > 0) ghosts.forward(*field);
    equal = communicator().largest(equal ? 0 : 1) == 0;
  }
  if (equal) damage->failure = Field();
  return damage;
}

}  // namespace perikit
