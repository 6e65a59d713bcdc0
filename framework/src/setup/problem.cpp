#include "setup/problem.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <stdexcept>

#include "cloud_balance/consistency.hpp"
#include "families/families.hpp"
#include "fracture/limits/damage.hpp"
#include "perikit/core/rank_values.hpp"
#include "perikit/core/warnings.hpp"
#include "setup/body/body.hpp"
#include "setup/body/local_body.hpp"
#include "setup/body/several_ranks.hpp"
#include "setup/body/thin_pieces.hpp"
#include "setup/conditions.hpp"
#include "setup/doubts_of_body.hpp"
#include "setup/gradient_order.hpp"
#include "setup/laminate_interfaces.hpp"
#include "setup/materials.hpp"
#include "setup/point_terms.hpp"
#include "setup/surfaces/image_planes.hpp"

namespace perikit {

namespace {

/// The number of the material of images, after those of the scene; that of the far points of a part of a body comes after all.
std::uint16_t image_material(const Scene& scene) { return static_cast<std::uint16_t>(scene.regions.size() + 1); }
std::uint16_t far_material(const Scene& scene, bool images) { return static_cast<std::uint16_t>(image_material(scene) + (images ? 1 : 0)); }

/// What lies beyond held faces, planes of symmetry and periodic sides.
struct Beyond {
  std::shared_ptr<const Images> images = std::make_shared<const Images>();  ///< of several ranks: what this one has of them
  std::vector<FaceMotion> motions;
  std::vector<std::string> notes;  ///< where sides were found to lie
  std::shared_ptr<const Interfaces> interfaces;   ///< null: no laminates
};

Beyond place_images(const Scene& scene, Body& body, bool quasi_static) {
  ScenePlanes planes = build_planes(scene, placed_points(body), quasi_static);
  if (planes.planes.empty() && planes.surfaces.empty()) return {};
  auto images = std::make_shared<const Images>(make_images(body, planes.planes, planes.surfaces));
  try {
    body = Body(body, *images, image_material(scene));
  } catch (const OverlappingImage& error) {
    refuse_overlap(planes, error);
  }
  return {std::move(images), std::move(planes.motions), std::move(planes.notes), nullptr};
}

/// How far the forces of a formulation reach (partition.hpp).
Partition::Reach reach_of(const Formulation& formulation) {
  return {.bonds = formulation.bond && formulation.far_share > 0 ? 3 : 2,
          .blocks = formulation.weighted != nullptr || (formulation.point && formulation.order > 1),
          .sources = formulation.pairs != nullptr};  // samples of bonds to images ask for the moduli of both ends
}

/// The body of this rank, which no rank has as a whole.
Beyond place_part(const Scene& scene, const PartFactory& factory, const Formulation& formulation, ProblemParts& parts, bool quasi_static) {
  try {
    LocalBody local = build_local_body(scene, reach_of(formulation), far_material(scene, has_images(scene)), image_material(scene), quasi_static);
    parts.body = std::make_unique<const Body>(std::move(local.body));
    parts.partition = std::move(local.partition);
    Beyond beyond;
    if (local.images) {
      beyond.images = std::make_shared<const Images>(std::move(*local.images));
      beyond.motions = std::move(local.motions);
      beyond.notes = std::move(local.notes);
      parts.images = std::make_unique<const ImageMap>(*parts.body, *beyond.images);
    }
    beyond.interfaces = std::make_shared<const Interfaces>(
        build_interfaces(scene, factory, formulation, *parts.body, std::move(local.material), beyond.images->source));
    return beyond;
  } catch (const std::domain_error& error) {
    throw InputError(scene.body.position, "body", error.what());
  }
}

/// The body, on several ranks the part of this one.
Beyond place_points(const Scene& scene, const PartFactory& factory, const Formulation& formulation, ProblemParts& parts, bool quasi_static) {
  if (communicator().size() > 1) return place_part(scene, factory, formulation, parts, quasi_static);
  Body body = build_body(scene);
  std::vector<std::uint16_t> material = materials_of_points(body);
  Beyond beyond = place_images(scene, body, quasi_static);
  beyond.interfaces =
      std::make_shared<const Interfaces>(build_interfaces(scene, factory, formulation, body, std::move(material), beyond.images->source));
  parts.body = std::make_unique<const Body>(std::move(body));
  if (beyond.images->size() > 0) parts.images = std::make_unique<const ImageMap>(*parts.body, *beyond.images);
  return beyond;
}

void refuse_stress(const Scene& scene, const Body& body, const Formulation& formulation) {
  const bool stress = body.space() == Space::plane_stress || body.space() == Space::line_stress;
  if (!formulation.selective() || !stress) return;
  throw InputError(
      scene.body.position, "body",
      fmt::format(
          "found a state of stress with kinematics \"{}\", which needs the strain across the body; allowed: {} = \"strain\"",
          scene.kinematics->type, body.dimension() == 2 ? "plane" : "line"));
}

/// The scene's penalty, null without one; refused over kinematics that it does not suit.
std::shared_ptr<const Stabilization> build_stabilization(const Scene& scene, const PartFactory& factory,
                                                         const Formulation& formulation) {
  if (!scene.stabilization) return nullptr;
  if (!formulation.point) {
    throw InputError(scene.kinematics->values.position("stabilization"), "kinematics.stabilization",
                     fmt::format("found '{}' over {}; allowed: over kinematics with one gradient per point",
                                 scene.stabilization->type, scene.kinematics->type));
  }
  return factory.stabilization(*scene.stabilization);
}

std::unique_ptr<Families> build_families(const Scene& scene, const PartFactory& factory, const Body& body, const Formulation& formulation) {
  const FamilyNeeds needs{.influence = !formulation.pairs || formulation.pair_traits.influence, .shapes = !formulation.pairs};
  const std::shared_ptr<const InfluenceFunction> influence = factory.influence(*scene.influence);
  if (needs.influence) refuse_no_influence(scene, *influence);
  std::unique_ptr<Families> families;
  constexpr double none = std::numeric_limits<double>::infinity();
  double mine = none;  // the first of the points at one place, which may lie on few ranks; all say the same
  std::string message;
  try {
    families = Families::make(body, influence, needs);
  } catch (const CoincidentPoints& error) {
    mine = static_cast<double>(error.number());
    message = error.what();
  }
  const double first = -communicator().largest(-mine);
  if (first < none)
    throw InputError(scene.body.position, scene.body.lattice ? "body.lattice" : "body.points",
                     first_message(mine == first ? message : ""));
  return families;
}

/// Why no weights or gradients balance a constant stress on this body: what it is, and what there is instead. Nothing where some do.
struct Unbalanced {
  std::string found, allowed;
};
std::optional<Unbalanced> unbalanced(const Scene& scene, const ProblemParts& parts, const Formulation& formulation) {
  if (parts.body->lattice())
    return Unbalanced{"on a lattice, where a constant stress is in equilibrium already", "[body.points], or jitter > 0"};
  const auto of = [&](const char* what) { return fmt::format("with kinematics \"{}\"{}", scene.kinematics->type, what); };
  if (formulation.pairs)
    return Unbalanced{of(", a pair law without factors on its bonds"), "surface_correction = \"moments\", or kinematics with gradients"};
  if (formulation.force_state == ForceState::local)
    return Unbalanced{of(" and force_state = \"local\", whose forces are not -dE/du"), "force_state = \"variational\""};
  const bool moves_gradients = formulation.point || formulation.selective();
  if (moves_gradients && formulation.order > 1) return Unbalanced{of(" of order 2 or more"), "order = 1"};
  return std::nullopt;
}

/// What is asked of points that lie at random, unless the scene says consistent = false; null where nothing is. Where nothing
/// can be, a scene that says true is refused, and others get a warning.
std::shared_ptr<CloudConsistency> build_consistency(const Scene& scene, const ProblemParts& parts, const Formulation& formulation,
                                                    std::vector<std::string>& warnings) {
  // Cells that a held surface cuts, and images behind it, lie at random to each other.
  const bool surfaces = std::ranges::any_of(scene.boundaries, [](const BoundaryDescription& boundary) { return boundary.surface.has_value(); });
  if (!scene.consistent.value_or(scene.random_points() || surfaces)) return nullptr;
  if (formulation.pairs && formulation.pair_traits.factors == BondFactorsOf::moments && !parts.body->lattice()) return nullptr;   // factors see to it
  if (const auto reason = unbalanced(scene, parts, formulation)) {
    if (scene.consistent)
      throw InputError(scene.consistent_position, "family.consistent",
                       fmt::format("found true {}; allowed: {}", reason->found, reason->allowed));
    warnings.push_back(
        named("balance", fmt::format("points that lie at random {}: a constant stress is not in equilibrium, and the body is too soft, however "
                    "fine it is; consistent clouds need {}",
                    reason->found, reason->allowed)));
    return nullptr;
  }
  auto consistency = std::make_shared<CloudConsistency>();
  constexpr int most = 4;  // components: of a place in space, and of the weights' unknowns
  const auto ghosts = parts.partition ? std::make_shared<Ghosts>(*parts.partition, most) : nullptr;
  const ImageMap* const images = parts.images.get();
  if (!ghosts && !images) return consistency;
  consistency->extend = [ghosts, images](FieldView u) {
    if (ghosts) ghosts->forward(u);
    if (images) images->extend(u);
  };
  consistency->fold = [ghosts, images](FieldView force) {
    if (images) images->fold(force);
    if (ghosts) ghosts->clear(force);
  };
  consistency->copy_from_sources = [ghosts, images](FieldView field) {
    if (ghosts) ghosts->forward(field);
    if (images) images->copy_from_sources(field);
  };
  return consistency;
}

/// How multipliers of bond factors reach ghosts and images.
PointCopies copies_of_points(const ProblemParts& parts, const Images& images) {
  PointCopies copies;
  const auto ghosts = parts.partition ? std::make_shared<Ghosts>(*parts.partition, PointCopies::most_components) : nullptr;
  const ImageMap* const map = parts.images.get();
  if (!ghosts && !map) return copies;
  copies.copy = [ghosts, map](FieldView field) {
    if (ghosts) ghosts->forward(field);
    if (map) map->copy_from_sources(field);
  };
  if (!map) return copies;
  const Body& body = *parts.body;
  copies.mirrored.assign(body.stride(), {1, 1, 1});
  for (std::size_t k = 0; k < images.size(); ++k)
    copies.mirrored[static_cast<std::size_t>(body.internal()[body.points() - images.size() + k])] =
        images.operation[k].at_surface ? std::array<std::int8_t, 3>{} : images.operation[k].sign;
  return copies;
}

/// Factors of the bonds of a pair law, refused where bonds are so few that a uniform strain cannot have its energy inside.
std::shared_ptr<const BondFactors> build_factors(const Scene& scene, const ProblemParts& parts, const Formulation& formulation, const Images& images) {
  auto factors = find_bond_factors(formulation, *parts.families, *parts.laws, copies_of_points(parts, images));
  constexpr double most = 0.01;
  if (factors->inside > most) {
    const Body& body = *parts.body;
    throw InputError(scene.kinematics->values.position("surface_correction"), "kinematics.surface_correction",
                     fmt::format("found \"moments\" with a horizon of {:.4g} spacings, whose bonds are too few for the stiffness of the material: with the best factors it is off by {:.0f} %; "
                                 "allowed: a longer horizon, from 1.5 spacings on, or surface_correction = \"none\"",
                                 body.horizon() / body.spacing(), 100 * factors->inside));
  }
  return factors;
}

/// Refuses laws with history where forces are not the derivative of their work.
void refuse_history(const Scene& scene, const Laws& laws, const Formulation& formulation) {
  const auto sources = materials(scene);
  for (std::size_t id = 0; id < sources.size(); ++id) {
    if (laws.records()[id].material->state_components(laws.space()) == 0) continue;
    const PartValues& part = *sources[id];
    const auto refuse = [&](const std::string& with, const std::string& allowed) {
      throw InputError(part.values.position("type"), part.values.path() + ".type",
                       fmt::format("found \"{}\", a law whose stress depends on the path, with {}; allowed: {}", part.type, with, allowed));
    };
    if (formulation.force_state == ForceState::local) refuse("force_state = \"local\"", "a material without history, or \"variational\"");
    if (formulation.pairs && laws.records()[id].traits.dissipates)
      refuse(fmt::format("kinematics \"{}\", a pair law, which takes elastic constants from it and nothing else", scene.kinematics->type), "an elastic material, or a kinematics with gradients");
  }
}

}  // namespace

std::unique_ptr<BodyProblem> build_problem(const Scene& scene, const PartFactory& factory, const IntegratorTraits& integrator,
                                           WorkSteps& steps, std::vector<TermMaker> further) {
  const bool quasi_static = integrator.quasi_static;
  ProblemParts parts;
  TermParts of_terms{
      .formulation = make_formulation(factory.kinematics(*scene.kinematics)), .skip = scene.skip, .share = scene.share};
  refuse_on_ranks(scene, integrator);
  steps.begin("points");
  Beyond beyond = place_points(scene, factory, of_terms.formulation, parts, quasi_static);
  const Body& body = *parts.body;
  const Partition* const partition = parts.partition.get();
  refuse_stress(scene, body, of_terms.formulation);
  set_cell_moments(scene, body, of_terms.formulation);
  steps.begin("laws");
  parts.laws = build_laws(scene, factory, body, parts.images != nullptr);
  refuse_history(scene, *parts.laws, of_terms.formulation);
  steps.begin(fmt::format("families of {} points", body.points()));
  parts.families = build_families(scene, factory, body, of_terms.formulation);
  refuse_order(scene, of_terms.formulation, *parts.families);
  const auto ghosts = partition ? std::make_unique<Ghosts>(*partition, 1) : nullptr;
  std::vector<std::string> warnings = softening(scene, body, *parts.laws);
  refuse_thin_pieces(scene, *parts.families, ghosts.get(), warnings);
  of_terms.families = parts.families.get();
  of_terms.laws = parts.laws.get();
  of_terms.interfaces = beyond.interfaces;
  if (parts.images) of_terms.images = beyond.images;
  if (of_terms.formulation.pairs && of_terms.formulation.pair_traits.factors != BondFactorsOf::none) {
    steps.begin("factors of bonds");
    of_terms.factors = build_factors(scene, parts, of_terms.formulation, *beyond.images);
  }
  if (scene.damage) steps.begin("limits of bonds");
  std::unique_ptr<const BodyDamage> damage = build_damage(scene, factory, of_terms, parts.images.get(), *beyond.images, partition, quasi_static, warnings);
  steps.begin("weights");
  of_terms.consistency = build_consistency(scene, parts, of_terms.formulation, warnings);
  of_terms.stabilization = build_stabilization(scene, factory, of_terms.formulation);
  of_terms.further = std::move(further);
  if (TermMaker point_terms = build_point_terms(scene, factory, integrator)) of_terms.further.push_back(std::move(point_terms));
  steps.begin("evaluation points");
  if (of_terms.consistency) of_terms.consistency->show_share = [&steps](double share) { steps.share_done(share); };
  parts.terms = std::make_unique<Terms>(of_terms);
  if (damage) parts.fracture = std::make_unique<Fracture>(*parts.terms, std::move(damage));
  if (of_terms.consistency) of_terms.consistency->show_share = {};
  parts.kinematics = scene.kinematics->type;
  for (const auto& part : materials(scene)) parts.materials.push_back(part->type);
  parts.materials.resize(parts.laws->records().size(), scene.material->type);

  steps.begin("boundaries and loads");
  Constraints constraints = build_constraints(scene, body, *beyond.images, std::move(beyond.motions), quasi_static);
  State state(body);
  set_initial_state(scene, body, constraints, quasi_static, state);
  parts.notes = std::move(beyond.notes);
  parts.warnings = questionable(scene, *parts.families, constraints, quasi_static, state);
  parts.warnings.insert(parts.warnings.end(), warnings.begin(), warnings.end());
  Loads loads = build_loads(scene, of_terms, parts.images.get(), quasi_static);
  Masses masses(body, *parts.laws, missing_density(scene, body, *parts.laws));
  ProblemValues values{body, *parts.laws, std::move(state), std::move(masses), std::move(constraints), std::move(loads), parts.images.get()};
  return std::make_unique<BodyProblem>(std::move(parts), std::move(values));
}

}  // namespace perikit
