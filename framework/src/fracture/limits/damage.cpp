#include "fracture/limits/damage.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "body/interfaces.hpp"
#include "families/families.hpp"
#include "fracture/bond_copies.hpp"
#include "fracture/limits/crossing_bonds.hpp"
#include "perikit/core/communicator.hpp"
#include "perikit/core/warnings.hpp"
#include "problem/ghosts.hpp"

namespace perikit {

namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();

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

void refuse_unsuited(const Scene& scene, const Formulation& formulation, const DamageTraits& traits) {
  const auto refuse = [&](const std::string& found, const std::string& allowed) {
    throw InputError(scene.damage->values.position(""), "damage", fmt::format("found {}; allowed: {}", found, allowed));
  };
  const std::string criterion = fmt::format("\"{}\"", scene.damage->type);
  if (traits.stress && formulation.pairs)
    refuse(fmt::format("{} with kinematics \"{}\", whose bonds have no stress", criterion, scene.kinematics->type),
           "kinematics with gradients, or criteria by stretch or energy");
  if (formulation.force_state == ForceState::local) refuse("with kinematics.force_state = \"local\"", "\"variational\"");
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

/// Regions may overlap: the last one has a point, as it has its material. Side 0 is the rest.
std::uint16_t side_of(const Scene& scene, const std::string& name) {
  for (std::size_t r = scene.regions.size(); r-- > 0;)
    if (scene.regions[r].set == name) return static_cast<std::uint16_t>(r + 1);
  return 0;
}

/// Sides by point, of all points of this rank and of images.
std::vector<std::uint16_t> find_sides(const Scene& scene, const Body& body, const ImageMap* images, const Partition* partition) {
  Field sides = body.make_field(1);
  for (const RegionDescription& region : scene.regions)
    for (const std::int32_t p : body.set(region.set)) sides.data()[p] = side_of(scene, region.set);
  if (partition) Ghosts(*partition, 1).forward(sides);
  if (images) images->copy_from_sources(sides);
  std::vector<std::uint16_t> side(body.stride());
  std::transform(sides.data(), sides.data() + sides.size(), side.begin(), [](double of_point) { return static_cast<std::uint16_t>(of_point); });
  return side;
}

/// See BodyDamage::distance.
Field distances_from_interfaces(const Body& body, const Interfaces* interfaces) {
  Field distance = body.make_field(1);
  fill(infinite, distance);
  if (!interfaces) return distance;
  for (const Interface& interface : interfaces->all)
    for (std::size_t k = 0; k < interface.point.size(); ++k) {
      double& nearest = distance.data()[interface.point[k]];
      nearest = std::min(nearest, std::abs(interface.distance[k]));
    }
  return distance;
}

/// Limits of the bonds between regions by the numbers of the interface, with the material of either side: the least of that side.
void build_interfaces(const Scene& scene, const PartFactory& factory, const TermParts& parts, DamagePoint at, BodyDamage& damage) {
  const Body& body = parts.families->body();
  const InterfaceDescription& first = scene.interfaces.front();
  const auto refuse = [](const InterfaceDescription& interface, const std::string& message) {
    throw InputError(interface.damage->values.position(""), interface.damage->values.path(), message);
  };
  const DamageTraits of_body = damage.law->traits();
  if (!of_body.bits && !of_body.by_limits)
    refuse(first, fmt::format("found with \"{}\", whose bonds weaken by more numbers than two limits; allowed: criteria that break bonds at "
                              "once, or weaken them between their limits alone", scene.damage->type));
  for (const InterfaceDescription& interface : scene.interfaces) {
    InterfaceDamage own{{side_of(scene, interface.between[0]), side_of(scene, interface.between[1])}, {{{infinite, infinite}, {infinite, infinite}}}};
    const auto law = factory.damage(*interface.damage);
    if (law->traits().bits != of_body.bits)
      refuse(interface, fmt::format("found bonds that {}, unlike those of [damage]; allowed: the same for both",
                                    of_body.bits ? "weaken" : "break at once"));
    for (const std::int32_t index : body.owned()) {
      const auto p = static_cast<std::size_t>(index);
      const auto place = std::ranges::find(own.sides, damage.side[p]);
      if (place == own.sides.end()) continue;
      DamageLimits& of_side = own.limits[static_cast<std::size_t>(place - own.sides.begin())];
      at.moduli = parts.laws->moduli(p);
      try {
        const DamageLimits limits = law->limits(at);
        of_side = {std::min(of_side.onset, limits.onset), std::min(of_side.failure, limits.failure)};
      } catch (const std::domain_error& error) {
        refuse(interface, error.what());
      }
    }
    for (DamageLimits& of_side : own.limits)
      for (double* limit : {&of_side.onset, &of_side.failure}) *limit = -communicator().largest(-*limit);
    damage.interfaces.push_back(own);
  }
}

/// Bonds whose force falls from s_c/r^1/2 to zero at s_c r^1/2 do so in a zone about r bonds long. Where that is less than about eight spacings, the crack jumps
/// from row to row: what a row sets free beyond its share is lost, as where bonds break at once. Measured: framework/docs/fracture.md, "What a crack costs".
void warn_of_short_zone(const BodyFrame& frame, const ParameterValues& values, double mean_length, std::vector<std::string>& warnings) {
  if (!values.has("softening") || dimension(frame.space) == 1) return;
  const double softening = values.number("softening"), bonds = mean_length / frame.spacing, wanted = 8 / bonds;
  if (softening > 0.95 * wanted) return;
  const std::string remedy = fmt::format("at least {}.softening = {:.2g} for these bonds, {:.2g} spacings long on the mean, lets them weaken in equilibrium", values.path(),
                                         std::max(1.1, wanted), bonds);
  const std::string place = values.position("").line > 0 ? fmt::format("{} (line {})", values.path(), values.position("").line) : values.path();
  if (softening == 1)
    warnings.push_back(named("crack_cost", fmt::format(
        "{} breaks bonds at once, and in a quasi-static run what their neighbours spring back is lost: cracks take 1.2 to 3 times energy_release_rate; {}", place, remedy)));
  else
    warnings.push_back(named("crack_cost", fmt::format("{} lets bonds weaken in a zone that is short beside the spacing (softening = {:.3g}): in a quasi-static run cracks take more than "
                                   "energy_release_rate, by 10 % and more; {}",
                                   place, softening, remedy)));
}

/// Evaluation points that see two materials have stresses of their own: a laminate leaves out a part of its stencil, which the stiffer side takes for strain, and a
/// stabilization carries a part of the force. Measured: plugins/damage/max_stress/README.md.
void warn_of_interface_stresses(const Scene& scene, const Families& families, const Laws& laws, const BodyDamage& damage, std::vector<std::string>& warnings) {
  if (!damage.law->traits().stress || laws.records().size() == 1) return;
  constexpr double least = 3;   // below it bars fail at 0.9 of the strength and more
  const auto stiffness = [&](std::size_t p) { return laws.moduli(p).lambda + 2 * laws.moduli(p).mu; };
  double ratio = 1;
  FamilyArrays family;
  for (const std::int32_t index : families.body().owned()) {
    const auto p = static_cast<std::size_t>(index);
    const double own = stiffness(p);
    families.load(p, BondsOf::uncut, family);
    for (const std::int32_t far : family.far) {
      const auto q = static_cast<std::size_t>(far);
      if (damage.limits(p, q).onset < infinite && own > 0 && stiffness(q) > 0) ratio = std::max(ratio, std::max(own / stiffness(q), stiffness(q) / own));
    }
  }
  ratio = communicator().largest(ratio);
  if (ratio < least) return;
  warnings.push_back(named("interface_stress", fmt::format(
      "damage \"{}\" looks at stresses of bonds between materials of 1 : {:.3g} in stiffness, which are off there: bars in tension across such an interface fail at 0.7 to 0.8 of their strength "
      "at 1 : 10 and at a third of it at 1 : 100; a set of the points within two horizons of it under no_fail, or a criterion by stretch or energy, does not depend on them",
      scene.damage->type, ratio)));
}

}  // namespace

std::unique_ptr<const BodyDamage> build_damage(const Scene& scene, const PartFactory& factory, const TermParts& parts,
                                               const ImageMap* images, const Images& made, const Partition* partition, bool quasi_static,
                                               std::vector<std::string>& warnings) {
  if (!scene.damage) return nullptr;
  auto damage = std::make_unique<BodyDamage>();
  damage->law = factory.damage(*scene.damage);
  const bool gradually = gradual(scene, *damage->law, quasi_static);
  const ParameterValues& values = scene.damage->values;
  damage->second_law = values.boolean("second_law");   // the scene reader knows the default
  refuse_unsuited(scene, parts.formulation, damage->law->traits());
  const Body& body = parts.families->body();
  const Laws& laws = *parts.laws;
  damage->onset = body.make_field(1);
  damage->failure = body.make_field(1);
  if (gradually) damage->crack_speed = body.make_field(1);
  DamagePoint at{{body.space(), body.section(), body.horizon(), {}},
                 mean_bond_length(*parts.families->influence(), body.dimension(), body.horizon())};
  if (quasi_static) {
    const int d = body.dimension();
    const double length = parts.families->needs().influence ? at.mean_length : d / (d + 1.0) * body.horizon();
    warn_of_short_zone(body.frame(), values, length, warnings);
    for (const InterfaceDescription& interface : scene.interfaces) warn_of_short_zone(body.frame(), interface.damage->values, length, warnings);
  }
  if (images) damage->copies = std::make_shared<const BondCopies>(*parts.families, made);
  const bool moments = parts.formulation.pairs && parts.formulation.pair_traits.factors == BondFactorsOf::moments;
  if (!damage->by_stretch() || moments) {
    const CrossingBonds crossing = crossing_bonds(*parts.families, {parts.formulation, *parts.families, parts.factors.get()}, partition, images);
    at.crossing = crossing.plain;
    at.crossing_shares = crossing.shares;
    if (moments) at.counted_length = crossing.shares / (half_mean_cosine(body.dimension()) * crossing.of_family);
  }
  const bool uniform = laws.records().size() == 1 && laws.records().front().uniform;
  DamageLimits limits;
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
  if (!scene.interfaces.empty() || (damage->by_stretch() && !scene.regions.empty())) damage->side = find_sides(scene, body, images, partition);
  if (damage->by_stretch() && !damage->side.empty()) damage->distance = distances_from_interfaces(body, parts.interfaces.get());
  if (!scene.interfaces.empty()) build_interfaces(scene, factory, parts, at, *damage);
  for (const std::string& set : scene.no_fail)
    for (const std::int32_t p : body.set(set)) damage->onset.data()[p] = damage->failure.data()[p] = infinite;
  const std::array limits_of_points{&damage->onset, &damage->failure, &damage->crack_speed};
  if (partition) {
    Ghosts ghosts(*partition, 1);
    for (Field* field : limits_of_points)
      if (field->size() > 0) ghosts.forward(*field);
    equal = communicator().largest(equal ? 0 : 1) == 0;
  }
  for (Field* field : limits_of_points)
    if (images && field->size() > 0) images->copy_from_sources(*field);
  if (equal) damage->failure = Field();
  warn_of_interface_stresses(scene, *parts.families, laws, *damage, warnings);
  return damage;
}

}  // namespace perikit
