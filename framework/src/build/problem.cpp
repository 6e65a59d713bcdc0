#include "perikit/build/problem.hpp"

#include <fmt/format.h>

#include <stdexcept>

#include "build/conditions.hpp"
#include "build/damage.hpp"
#include "build/materials.hpp"
#include "perikit/build/body.hpp"
#include "perikit/core/communicator.hpp"

namespace perikit {

namespace {

/// The bodies of this rank and, where there are several, of all of them.
void place_points(const Scene& scene, bool lists, ProblemParts& parts) {
  Body whole = build_body(scene, lists);
  if (communicator().size() == 1) {
    parts.body = std::make_unique<const Body>(std::move(whole));
    return;
  }
  parts.partition = std::make_unique<const Partition>(std::move(whole), communicator().rank(), communicator().size());
  parts.body = std::make_unique<const Body>(parts.partition->part(static_cast<std::uint16_t>(scene.regions.size() + 1)));
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

std::unique_ptr<Model> build_model(const Scene& scene, const ModelParts& parts) {
  try {
    return make_model(parts);
  } catch (const std::domain_error& error) {
    throw InputError(scene.body.position, scene.body.lattice ? "body.lattice" : "body.points", error.what());
  }
}

/// Laws with history: refuses runs that have no steps of a path, and makes room.
void prepare_history(const Scene& scene, const ModelParts& parts, bool quasi_static, Model& model) {
  LawHistory* const history = parts.laws->history();
  if (!history) return;
  const auto sources = materials(scene);
  for (std::size_t id = 0; id < sources.size(); ++id) {
    if (parts.laws->records()[id].material->state_components(parts.body->space()) == 0) continue;
    const PartValues& part = *sources[id];
    const auto refuse = [&](const std::string& with, const std::string& allowed) {
      throw InputError(
          part.values.position("type"), part.values.path() + ".type",
          fmt::format("found \"{}\", a law whose stress depends on the path, with {}; allowed: {}", part.type, with, allowed));
    };
    if (quasi_static)
      refuse(fmt::format("integrator \"{}\", whose iterations are no steps of a path", scene.integrator->type),
             "an explicit integrator, or another material");
    if (parts.formulation.force_state == ForceState::local)
      refuse("force_state = \"local\"", "a material without history, or \"variational\"");
  }
  // The first evaluation only counts.
  const Field rest = parts.body->make_field(parts.body->dimension());
  Field force = parts.body->make_field(parts.body->dimension());
  model.forces(rest, force, nullptr);
  history->allocate();
}

}  // namespace

std::unique_ptr<ModelProblem> build_problem(const Scene& scene, const PartFactory& factory, const IntegratorTraits& integrator) {
  const bool quasi_static = integrator.quasi_static;
  ProblemParts parts;
  std::shared_ptr<const Damage> criterion = build_criterion(scene, factory, quasi_static);
  place_points(scene, criterion && !criterion->traits().bits, parts);
  const Body& body = *parts.body;
  const Partition* const partition = parts.partition.get();

  ModelParts of_model{.body = &body,
                      .formulation = make_formulation(factory.kinematics(*scene.kinematics)),
                      .influence = factory.influence(*scene.influence),
                      .skip = scene.skip,
                      .share = scene.share};
  refuse_stress(scene, body, of_model.formulation);
  parts.laws = build_laws(scene, factory, body, partition != nullptr);
  of_model.laws = parts.laws.get();
  parts.fracture = FractureRecord(build_damage(scene, std::move(criterion), of_model, partition != nullptr));
  of_model.damage = parts.fracture.damage();
  of_model.stabilization = build_stabilization(scene, factory, of_model.formulation);
  parts.model = build_model(scene, of_model);
  prepare_history(scene, of_model, quasi_static, *parts.model);
  parts.kinematics = scene.kinematics->type;
  for (const auto& part : materials(scene)) parts.materials.push_back(part->type);
  if (partition) parts.materials.push_back(scene.material->type);  // of ghosts

  State state(body);
  set_initial_state(scene, body, partition, state);
  Constraints constraints = build_constraints(scene, body, quasi_static);
  Loads loads = build_loads(scene, of_model, partition, quasi_static);
  Masses masses(body, *parts.laws, missing_density(scene, body, *parts.laws));
  ProblemValues values{body, *parts.laws, std::move(state), std::move(masses), std::move(constraints), std::move(loads)};
  return std::make_unique<ModelProblem>(std::move(parts), std::move(values));
}

}  // namespace perikit
